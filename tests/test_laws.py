"""A law that nobody thought of is to hold on the test logs as well: the same model, settled on these, is asked too."""

import json
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest

from sysid import experiment_logs, flexible, pipeline
from sysid.effect import NotFinite
from sysid.lowpass import widest
from sysid.view import elsewhere, first_view, law, opened
from sysid.view.laws import ripples


def settling_contact(size: float):
    """The elbow's friction rises again after each reversal, within half a second."""

    def torque(q, qd, qdd, t, load, memory):
        if np.sign(qd[1]) != memory.get("way"):
            memory.update(way=np.sign(qd[1]), since=t)
        return np.array([0.0, size * (1.0 - np.exp(-(t - memory["since"]) / 0.5)) * np.tanh(qd[1] / 0.02)])

    return torque


def both_views(folder):
    """The first view of an experiment, and the same model on its test logs."""
    experiment = pipeline.load(folder)
    view = first_view(experiment, pipeline.fit(experiment))
    return view, elsewhere(view, experiment_logs.read(experiment, view.model.robot, experiment.data.test))


@pytest.fixture(scope="module")
def quiet(simulated):
    return both_views(simulated("laws-control", seed=4))


@pytest.fixture(scope="module")
def logs(simulated):
    """The training log and the test log of the same."""
    experiment = pipeline.load(simulated("laws-control", seed=4))
    robot = pipeline.fit(experiment).model.robot
    return [experiment_logs.read(experiment, robot, part)[0] for part in (experiment.data.train, experiment.data.test)]


def test_the_model_is_settled_anew(quiet):
    view, more = quiet
    assert more.step == view.step and more.cutoff == view.cutoff
    assert more.model.size == view.model.size and not np.allclose(more.settled.x, view.settled.x, rtol=1e-6)
    np.testing.assert_allclose(more.rms(), view.rms(), rtol=0.25)
    np.testing.assert_array_equal(more.weights, view.weights)


def test_the_noise_of_the_angles_is_drawn_anew_on_each_log(quiet):
    view, more = quiet
    one, other = ((v.rough.pieces[0].q - v.motion.pieces[0].q)[:500, 0] for v in (view, more))
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.3


def test_rows_count_where_both_draws_know_the_sign_of_a_speed(quiet):
    """A row that one draw leaves out would be noise in the other, and where it turns round once more friction's jump is."""
    for view in quiet:
        for plain, rough in zip(view.motion.pieces, view.rough.pieces):
            np.testing.assert_array_equal(plain.use, rough.use)
            assert (np.sign(plain.qd) == np.sign(rough.qd))[plain.use].all() and plain.use.any()


def test_a_band_is_not_narrowed_where_short_logs_would_be_lost(simulated, monkeypatch):
    """Nor where the test logs would be too short for it."""
    experiment = pipeline.load(simulated("laws-control", seed=4))
    fit = pipeline.fit(experiment)
    train, test = (experiment_logs.read(experiment, fit.model.robot, part) for part in (experiment.data.train, experiment.data.test))
    monkeypatch.setattr(opened, "narrowed", lambda cutoff, share: 0.5 * cutoff)
    monkeypatch.setattr(opened, "MOTION", 0.0)
    wide, once = widest(train), 0.5 * widest(train)
    assert first_view(experiment, fit, train, test).cutoff == pytest.approx(wide / 8.0)
    short = [replace(log, segments=tuple(cut(log, slice(0, 500)).segments)) for log in test]
    held = first_view(experiment, fit, train, short).cutoff
    assert held in (pytest.approx(wide), pytest.approx(once), pytest.approx(0.5 * once)) and held > wide / 8.0
    pieces = [cut(log, *(slice(k, k + 500) for k in range(0, len(log.segments[0].t) - 500, 500))) for log in train]
    assert first_view(experiment, fit, pieces).cutoff > wide / 8.0


def cut(log, *slices, **changes):
    """A log whose one segment is cut into several, a second apart."""
    (own,) = log.segments
    part = lambda k, s: replace(own, t=own.t[s] + k, q=own.q[s], tau=own.tau[s], signals={}, clock=None, **changes)  # noqa: E731
    return replace(log, segments=tuple(part(k, s) for k, s in enumerate(slices)))


def test_logs_that_cannot_be_asked_are_none(quiet, logs):
    """Nothing; too short; as many rows, but another time apart; samples of the training log."""
    view, (train, test) = quiet[0], logs
    assert elsewhere(view, []) is None and elsewhere(view, [cut(test, slice(0, 120))]) is None
    assert elsewhere(view, [cut(test, slice(None), step=1.5 * test.segments[0].step)]) is None
    assert elsewhere(view, [train], [train]) is None and elsewhere(view, [cut(train, slice(500, 4000))], [train]) is None
    assert elsewhere(view, [test], [train]) is not None


@pytest.mark.parametrize("short", [2, 3, 20])
def test_a_piece_of_a_few_samples_is_passed_over(quiet, logs, short):
    """A gap may leave such a piece; the rest of the log is asked all the same."""
    view, (_, test) = quiet[0], logs
    more = elsewhere(view, [cut(test, slice(0, 2500), slice(2600, 2600 + short), slice(3000, None))])
    assert len(more.motion.pieces) == 2
    # every piece has a past of its own, of its motion and of that with the angles' noise again
    seen = []
    plain = flexible.products

    def asked(known, joint, use, piece, *rest):
        seen.append(piece)
        return plain(known, joint, use, piece, *rest)

    with mock.patch.object(flexible, "products", asked):
        assert law(view, 1, more).chance > 0.01
    cuts = np.flatnonzero(np.diff(seen[0])) + 1
    assert np.array_equal([len(own) for own in np.split(seen[0], cuts)], [n for v in (view, more) for _ in range(2) for n in np.bincount(v.rows.piece)])


def test_a_model_that_is_no_number_there_is_none(quiet, logs, monkeypatch):
    def settle(*given, **how):
        raise NotFinite("no finite number", where="t = 1 s", allowed="numbers", do="look")

    monkeypatch.setattr("sysid.view.view.settle", settle)
    assert elsewhere(quiet[0], [logs[1]]) is None


def test_nothing_stands_out_on_both_where_nothing_is(quiet):
    view, more = quiet
    assert min(law(view, j, more).chance for j in range(2)) > 0.01


@pytest.mark.long
def test_a_law_with_a_past_stands_out_more_where_it_holds_on_test_logs_as_well(simulated):
    view, more = both_views(simulated("laws-contact", settling_contact(0.09), seed=4))
    alone, both = law(view, 1), law(view, 1, more)
    assert both.chance < 0.1 * alone.chance and both.chance < 1e-3 and "qd_elbow" in both.variables
    assert 0.0 < both.share < 1.0


def growing_ripple(size: float, k: float):
    """The elbow's ripple, stronger the faster it turns."""
    return lambda q, qd, qdd, t, load, memory: np.array([0.0, size * abs(qd[1]) * np.sin(k * q[1])])


def test_of_a_ripple_that_grows_with_the_speed_cogging_is_a_part(diagnosed):
    """What cogging leaves of it follows the same periods, and is neither noise nor nothing."""
    found = diagnosed("laws-ripple", growing_ripple(0.12, 16.0), seed=4, duration=20.0)
    (claim,) = found.claims
    assert (claim.head.effect, claim.head.joint) == ("cogging", "elbow")
    assert ripples(claim.step.after.model, 1) == [pytest.approx(16.0, abs=0.5)] and ripples(claim.step.after.model, 0) == []
    elbow = found.verdict[1]
    assert elbow.status == "unknown" and elbow.left.share > 0.8 and max(elbow.left.shares, key=elbow.left.shares.get) == "q_elbow and qd_elbow"
    noise = json.loads((found.fit.experiment.path.parent / "truth.json").read_text())["logs"]["test"]["noise_rms"]["elbow"]
    assert found.floors["elbow"].rms is None or found.floors["elbow"].rms == pytest.approx(noise, rel=0.25)
