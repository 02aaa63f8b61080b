"""A model that follows: equal to the batch fit of the same rows, whitening, a payload told and sized, no alarm without a change."""

from dataclasses import replace

import numpy as np
import pytest

import sysid
from scripts.blind_parts.robots import PLANAR
from sysid import config, pipeline, regressor, results
from sysid.errors import SysidError
from sysid.inertia.consistency import is_consistent
from sysid.online import Online, monitor
from sysid.online.whitening import whitening
from sysid.reduction import triangle
from tests.conftest import csv
from tests.test_lowpass import smooth

RATE, STANDSTILL = 250.0, 0.05
CONFIG = (
    "robot: {urdf: robot.urdf}\nmodel: {effects: [viscous, coulomb]}\nprior: {weight: 1.0e-2}\n"
    f"preprocess: {{standstill: {STANDSTILL}, events: keep}}\nsolver: {{tolerance: 1.0e-10}}\n"
)
LOAD = np.array([0.8, 0.8 * 0.32, 0.0, 0.8 * 0.02, 0.002, 0.8 * 0.32**2 + 0.003, 0.8 * 0.32**2 + 0.003, 0.0, 0.0, 0.0])


def samples(arm, seconds: float, seed: int, *, load=0.0, friction=(0.5, 0.3)):
    """t, q, tau of the planar arm under noise half of which has a memory of 0.2 s."""
    from scripts.fleet_parts.robots import coloured

    rng, t = np.random.default_rng(seed), np.arange(int(seconds * RATE)) / RATE
    q, qd, qdd = smooth(t, seed, 1.0)
    pi = np.array(arm.prior) * 1.1
    pi[-1] += load
    tau = regressor.torque(arm, pi, q, qd, qdd) + 0.3 * qd + np.array(friction) * np.sign(qd)
    return t, q, tau + 0.1 * coloured(rng, q.shape, 1.0 / RATE)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory, planar):
    """An experiment's folder, its fit, and its run folder."""
    folder = tmp_path_factory.mktemp("online")
    (folder / "config.yaml").write_text(CONFIG)
    (folder / "robot.urdf").write_text(PLANAR)
    for part, seconds, seed in (("train", 30.0, 1), ("test", 40.0, 2)):
        t, q, tau = samples(planar, seconds, seed)
        columns = {"t": t} | {f"q_{j}": q[:, k] for k, j in enumerate(planar.joints)} | {f"tau_{j}": tau[:, k] for k, j in enumerate(planar.joints)}
        (folder / f"{part}.csv").write_text(csv(columns))
    fit = pipeline.fit(pipeline.load(folder))
    results.write(fit, folder / "run")
    return folder, fit, folder / "run"


def test_what_follows_is_the_batch_fit_of_the_same_rows(fitted, planar):
    _, fit, run = fitted
    _, q, tau = samples(planar, 30.0, 1)
    for model in (fit, run):
        online = Online(model, rate=RATE, standstill=STANDSTILL, watch=False)
        for first in range(0, len(q), 997):
            online.add(q[first : first + 997], tau[first : first + 997])
            assert is_consistent(online.bodies).all()
        rest = len(q) - 2 * online._stream.smoother.reach - online._follower.rows
        assert 0 <= rest < online._tick  # what is no whole tick yet
        # a batch fit that ends where the ticks do
        cut = fit.experiment.data.train[0].model_copy(update={"stop": (len(q) - rest) / RATE})
        data = fit.experiment.data.model_copy(update={"train": [cut]})
        batch = pipeline.fit(fit.experiment.model_copy(update={"data": data}))
        grams = [own.T @ own for own in (online._follower.factor, batch.compressed.total())]
        np.testing.assert_allclose(*grams, rtol=0, atol=1e-12 * np.abs(grams[0]).max())  # the same rows
        # both optima are proven, to 1e-25 of the objective
        assert np.linalg.norm(online.x - batch.x) < 1e-6 * np.linalg.norm(batch.x)
        assert np.all(np.abs(online.x - batch.x)[batch.uncertainty.std > 0] < 1e-4 * batch.uncertainty.std[batch.uncertainty.std > 0])


def test_one_sample_at_a_time_is_the_same_as_many(fitted, planar):
    _, fit, _ = fitted
    _, q, tau = samples(planar, 6.0, 3)
    one, many = (Online(fit, rate=RATE, memory=2.0, watch=False) for _ in range(2))
    for row in zip(q, tau):
        one.add(*row)
    many.add(q, tau)
    assert one.time == pytest.approx(many.time) and one.late == pytest.approx(0.05, abs=0.005)
    grams = [own._follower.factor.T @ own._follower.factor for own in (one, many)]
    np.testing.assert_allclose(*grams, rtol=0, atol=1e-10 * np.abs(grams[0]).max())


def test_what_is_long_ago_is_forgotten(fitted, planar):
    _, fit, _ = fitted
    online = Online(fit, rate=RATE, memory=3.0, watch=False)
    online.add(*samples(planar, 20.0, 4)[1:])
    _, q, tau = samples(planar, 20.0, 5, friction=(0.5, 0.8))
    online.add(q, tau)
    place = fit.model.names.index("coulomb.elbow.Fc")
    assert online.x[place] == pytest.approx(0.8, abs=0.05)
    # the triangle is that of the weighed rows
    stacked, weight = online._follower.factor, np.exp(-1.0 / RATE / 3.0)
    assert online._follower.forgetting == pytest.approx(weight)
    assert triangle(stacked.copy()).shape == stacked.shape


def test_innovations_of_coloured_noise_are_white():
    rng, n = np.random.default_rng(6), 40_000
    noise = np.zeros(n)
    for k in range(1, n):
        noise[k] = 0.8 * noise[k - 1] + rng.normal()
    whole = np.ones((1, n), dtype=bool)
    white = whitening(noise[None], whole)
    assert white.filters[0, :2] == pytest.approx([1.0, -0.8], abs=0.02)
    whole[0, ::50] = False
    found = white(noise[None, :, None], whole)[0, :, 0]
    assert found[found != 0.0].std() == pytest.approx(1.0, abs=0.02)
    assert np.count_nonzero(found) == pytest.approx(n * (1.0 - (white.order + 1) / 50.0), rel=0.01)


def test_a_payload_is_told_at_once_and_sized(fitted, planar):
    _, _, run = fitted
    online = sysid.Online(run, rate=RATE, follow=False)
    assert online.add(*samples(planar, 20.0, 7)[1:]) is None and online.change is None
    begun, alarm = online.time, None
    _, q, tau = samples(planar, 8.0, 8, load=LOAD)
    online.gap()
    for row in zip(q, tau):
        alarm = online.add(*row) or alarm
    assert (alarm.effect, alarm.joint) == ("payload", "*") and alarm.time - begun < 2.0 and alarm.p < 1e-6
    value, std, unit = online.change.parameters["payload.*.m"]
    assert unit == "kg" and abs(value - 0.8) < 3.0 * std + 0.005 and std < 0.1
    assert "payload" in repr(online)
    assert np.isinf(online.change.parameters["payload.*.hy"][1])  # across the plane no torque tells it
    # the rows of the alarm may have spoken for something else: all since it began say what changed
    online._watch.alarm = replace(alarm, effect="viscous", joint="elbow")
    assert online.change.effect == "payload" and online.change.parameters["payload.*.m"][:2] == (value, std)
    online.clear()
    assert online.alarm is None and online.change is None


def test_friction_and_bias_are_told_on_their_joint(fitted, planar):
    _, fit, _ = fitted
    online = Online(fit, rate=RATE, follow=False)
    _, q, tau = samples(planar, 8.0, 9, friction=(0.5, 0.9))
    alarm = online.add(q, tau)
    assert (alarm.effect, alarm.joint) == ("coulomb", "elbow")
    value, std, _ = online.change.parameters["coulomb.elbow.Fc"]
    assert abs(value - 0.6) < 4.0 * std < 0.2
    online.gap()
    online.clear()
    _, q, tau = samples(planar, 8.0, 10)
    alarm = online.add(q, tau + [0.0, 0.6])
    assert (alarm.effect, alarm.joint) == ("torque_bias", "elbow")


def test_nothing_is_told_where_nothing_changed(fitted, planar):
    _, fit, _ = fitted
    online = Online(fit, rate=RATE, follow=False)
    for seed in range(20, 28):
        online.gap()
        assert online.add(*samples(planar, 60.0, seed)[1:]) is None, seed


def test_the_test_is_a_chi_square_where_nothing_changed():
    rng, n = np.random.default_rng(11), 3000
    white = rng.normal(size=(2, 8 * n, 14))
    found, freedom = monitor.worth(monitor.ticks_of(np.concatenate([white, np.zeros((2, 8 * n, 1))], axis=2), np.arange(n), 8))
    np.testing.assert_allclose(found.mean(0), 1.0, atol=0.1)
    np.testing.assert_allclose(found.var(0) * freedom, 2.0, rtol=0.25)


def test_what_cannot_be_followed_is_refused(fitted, tmp_path):
    folder, fit, run = fitted
    for how, said in (({"rate": 0.0}, "rate"), ({"rate": RATE, "memory": -1.0}, "memory"), ({"rate": 1000.0}, "sound")):
        with pytest.raises(SysidError, match=said):
            Online(run, **how)
    online = Online(fit, rate=RATE, watch=False)
    with pytest.raises(SysidError, match="both"):
        online.add(np.zeros(3), np.zeros(3))
    with pytest.raises(SysidError, match="finite"):
        online.add(np.full((200, 2), np.nan), np.zeros((200, 2)))
    other = config.load(folder).model_copy(update={"preprocess": fit.experiment.preprocess.model_copy(update={"filter": "butterworth"})})
    with pytest.raises(SysidError, match="whole log"):
        Online(pipeline.fit(other), rate=RATE)
