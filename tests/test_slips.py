"""Steps of an angle that no motion makes are found and taken out; what moves is left as it is."""

import numpy as np
import pytest

from sysid import experiment_logs, pipeline
from sysid.slips import without_slips
from sysid.smoother import Smoother
from sysid.specs import PreprocessSpec

STEP, DOF = 4e-3, 3


def motion(t, seed: int):
    """Angles (n, dof) of an arm at times t (n, dof)."""
    rng = np.random.default_rng(seed)
    waves = zip(rng.uniform(0.2, 1.2, 4), rng.uniform(0.2, 0.6, (4, DOF)), rng.uniform(0.0, 6.0, (4, DOF)))
    return sum(a * np.sin(2.0 * np.pi * f * t + p) for f, a, p in waves)


def early_and_late(seed: int, *, n: int = 2500, usual: int = 60, by: float = 1e-3):
    """Times (n, dof) at which each joint's own clock has its samples: it drifts, and jumps back by a millisecond about every quarter of a
    second; and the samples (dof, k) before which it does."""
    rng = np.random.default_rng(seed)
    t, jumps = np.repeat(STEP * np.arange(n)[:, None], DOF, axis=1), []
    for j in range(DOF):
        at = np.arange(usual, n - 30, usual) + rng.integers(-15, 15, len(np.arange(usual, n - 30, usual)))
        last = np.searchsorted(at, np.arange(n), side="right")  # how often it has jumped
        drift = by * (np.arange(n) / usual - last)
        t[:, j] += drift
        jumps.append(at)
    return t, jumps


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_samples_that_are_early_or_late_are_found_and_put_in_their_place(seed):
    """What the filter makes of them in the acceleration is a third and less of what it was; none is found beside them."""
    t, jumps = early_and_late(seed)
    rng = np.random.default_rng(seed)
    even = motion(np.repeat(STEP * np.arange(len(t))[:, None], DOF, axis=1), seed)
    q = motion(t, seed) + 2e-6 * rng.normal(size=t.shape)
    mended, found = without_slips(q, STEP)
    smoother = Smoother(PreprocessSpec(), STEP)
    wrong = lambda angles: np.std(smoother.differentiate(angles)[2] - smoother.differentiate(even)[2], axis=0)  # noqa: E731
    assert (wrong(mended) < wrong(q) / 3.0).all()
    speed = np.abs(np.gradient(even, STEP, axis=0))
    for j, (places, own) in enumerate(zip(jumps, found)):
        fast = [k for k in places if speed[k, j] > 0.5]
        assert np.mean([any(a <= k <= b for a, b in own) for k in fast]) > 0.9
        assert all(any(abs(k - a) <= 1 for k in places) for a, _ in own)


@pytest.mark.parametrize("grain", [0.0, 2.0 * np.pi / 2**14])
def test_a_motion_has_none(grain):
    """Nor has rounding, nor a clock whose errors are white, whose steps do not stay; angles without any are returned as they are."""
    t = np.repeat(STEP * np.arange(4000)[:, None], DOF, axis=1)
    for seed in range(5):
        rng = np.random.default_rng(seed)
        white = t + 3e-4 * rng.normal(size=(len(t), 1))
        for q in (motion(t, seed), motion(white, seed)):
            q = np.round(q / grain) * grain if grain else q + 2e-6 * rng.normal(size=q.shape)
            same, found = without_slips(q, STEP)
            assert not any(found) and same is q


@pytest.mark.parametrize("rate", [250.0, 500.0, 1000.0])
@pytest.mark.parametrize("how", ["late", "twice"])
def test_a_late_sample_or_one_that_is_written_twice_is_no_slip(rate, how):
    """It is beside the others alone, which go on as they were: nothing that stays is taken out."""
    for seed in range(3):
        rng, n = np.random.default_rng(seed), round(12.0 * rate)
        t = np.repeat(np.arange(n)[:, None] / rate, DOF, axis=1)
        for k in rng.choice(np.arange(30, n - 30), n // 150, replace=False):
            t[k] = t[k - 1] if how == "twice" else t[k] - 0.5 / rate
        q = motion(t, seed) + 2e-6 * rng.normal(size=t.shape)
        mended, found = without_slips(q, 1.0 / rate)
        assert sum(map(len, found)) <= 2 and np.abs(mended - q).max() < 1e-3


@pytest.mark.parametrize("step", [5e-3, 1e-2, 2e-2])
def test_a_joint_that_sticks_and_slips_has_none(step):
    """A hundredth of a radian a second, in jumps of two milliradians that take 15 ms; nor where samples are too far apart to tell."""
    t = np.arange(0.0, 30.0, step)
    jumps = 0.2 * np.floor(t / 0.2) + np.clip((t % 0.2) / 0.015, 0.0, 1.0) * 0.2
    q = 0.01 * (jumps + 0.05 * t)[:, None] + 1e-6 * np.random.default_rng(1).normal(size=(len(t), 1))
    assert not any(without_slips(q, step)[1])


@pytest.mark.long
@pytest.mark.parametrize("how", [{"motion": "moves", "knocks": 2}, {"motion": "moves", "brakes": True}, {"spikes": 0.3}, {"motion": "sines"}])
def test_logs_with_other_faults_have_none(simulated, how):
    """Stops, knocks, brakes, friction that turns its sign; at two rates."""
    for rate in (250.0, 1000.0):
        spec = pipeline.load(simulated(f"no slip {how} {rate:g}", seed=3, duration=8.0, rate=rate, **how))
        machine, _, _ = pipeline.build(spec)
        for log in experiment_logs.read(spec, machine, [*spec.data.train, *spec.data.test]):
            assert not [event for event in log.events if event.kind == "slip"]


def test_they_are_told_and_no_row_is_left_out_for_them(experiment):
    """And stay in the angles with `events: keep`."""

    def slipped(columns):
        out = dict(columns)
        out["q_elbow"] = columns["q_elbow"] + 0.02 * (np.arange(len(columns["q_elbow"])) >= 300)
        return out

    fits = {}
    for name, how in (
        ("clean", {}),
        ("slipped", {"train": slipped}),
        ("kept", {"train": slipped, "config": {"preprocess.events": "keep", "preprocess.window": 0.1}}),
    ):
        fits[name] = pipeline.fit(pipeline.load(experiment(name=name, **how)))
    told = [n for n in fits["slipped"].notices if "early or late" in n]
    (event,) = [e for e in fits["slipped"].events if e["kind"] == "slip"]
    assert event["joints"] == ["elbow"] and len(told) == 1 and "taken out of the angle: 1 step of an angle" in told[0]
    assert fits["slipped"].left_out == fits["clean"].left_out
    rms = {name: fit.rms("train")["elbow"] for name, fit in fits.items()}
    assert rms["slipped"] < 1.05 * rms["clean"] < 1.5 * rms["clean"] < rms["kept"]
    assert not [e for e in fits["kept"].events if e["kind"] == "slip"]
