"""Filters against closed forms."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid import filters
from sysid.errors import ConfigError, LogError, SysidWarning
from sysid.filter_errors import held_out
from sysid.listed_effects import build
from sysid.log import Log, Segment
from sysid.preprocess import prepare
from sysid.smoother import Smoother, _convolved, rate, savitzky_golay
from sysid.specs import EffectSpec, PreprocessSpec
from tests.problems import arm, arm_log

STEP = 1e-3


def log(q, tau=None, step=STEP) -> Log:
    q = np.asarray(q, dtype=float).reshape(len(q), -1)
    t = step * np.arange(len(q))
    return Log("made", Path("made"), "", (Segment(t, step, q, q.copy() if tau is None else tau.reshape(q.shape), None, None, {}),))


def test_savitzky_golay_is_exact_on_quartics_and_drops_the_edges():
    t = STEP * np.arange(600) - 0.3
    q = 1 + 2 * t - 3 * t**2 + 4 * t**3 - 5 * t**4
    motion = prepare([log(q)], PreprocessSpec(), ("a",))
    (piece,) = motion.pieces
    assert motion.samples == 600 - 100  # a window of 100 ms at 1 kHz is 101 samples, 50 at each end
    inner = slice(50, 550)
    x = t[inner, None]
    np.testing.assert_allclose(piece.q, q[inner, None], atol=1e-12)
    np.testing.assert_allclose(piece.qd, 2 - 6 * x + 12 * x**2 - 20 * x**3, atol=1e-9)
    np.testing.assert_allclose(piece.qdd, -6 + 24 * x - 60 * x**2, atol=1e-6)
    np.testing.assert_array_equal(piece.tau, q[inner, None])  # torque untouched


@pytest.mark.parametrize(("length", "order"), [(5, 4), (7, 2), (101, 4), (201, 4)])
def test_savitzky_golay_is_scipy_s(length, order):
    from scipy.signal import savgol_filter

    values = np.random.default_rng(0).normal(size=(2000, 3)).cumsum(0)
    half = length // 2
    for derivative in range(3):
        ours = _convolved(values, savitzky_golay(length, order, derivative, STEP))[half:-half]
        theirs = savgol_filter(values, length, order, deriv=derivative, delta=STEP, axis=0)[half:-half]
        # scipy fits in powers of sample numbers up to 50^4 and keeps nine digits
        np.testing.assert_allclose(ours, theirs, atol=1e-8 * np.abs(theirs).max())


@pytest.mark.parametrize("half", [2, 5, 20])
def test_rate_is_scipy_s_to_both_ends(half):
    from scipy.signal import savgol_filter

    values = np.random.default_rng(half).normal(size=(2, 3, 90))
    theirs = savgol_filter(values, 2 * half + 1, 4, deriv=1, delta=STEP, axis=-1)
    np.testing.assert_allclose(rate(values, STEP, half, 4), theirs, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())


def test_rate_between_two_windows_is_their_mean():
    values = np.random.default_rng(6).normal(size=(2, 40))
    narrow, wide = (rate(values, STEP, half, 4) for half in (5, 6))
    np.testing.assert_allclose(rate(values, STEP, 5.25, 4), 0.75 * narrow + 0.25 * wide, atol=1e-9 * np.abs(narrow).max())


def test_savitzky_golay_of_a_high_order_is_still_a_fit():
    """Order 9 over 401 samples: powers of sample numbers have no digits left there (scipy's filter returns zero)."""
    t = np.linspace(-1, 1, 2001)
    values = np.polynomial.chebyshev.chebval(t, np.random.default_rng(0).normal(size=10))[:, None]
    got = _convolved(values, savitzky_golay(401, 9, 0, STEP))[200:-200]
    np.testing.assert_allclose(got, values[200:-200], atol=1e-10)


def test_savitzky_golay_is_least_squares_in_its_window():
    rng = np.random.default_rng(0)
    q = rng.normal(size=201)
    (piece,) = prepare([log(q)], PreprocessSpec(), ("a",)).pieces
    u = STEP * np.arange(-50, 51)
    for middle in (50, 100, 150):
        fit = np.polynomial.polynomial.polyfit(u, q[middle - 50 : middle + 51], 4)
        row = middle - 50
        np.testing.assert_allclose([piece.q[row, 0], piece.qd[row, 0], piece.qdd[row, 0] / 2], fit[:3], rtol=1e-6)


@pytest.mark.parametrize("cutoff", [5.0, 20.0])
def test_butterworth_is_zero_phase_with_its_squared_gain(cutoff):
    t = STEP * np.arange(20000)
    for f in (1.0, 4.0, 12.0):
        q = np.sin(2 * np.pi * f * t)
        (piece,) = prepare([log(q)], PreprocessSpec(filter="butterworth", cutoff=cutoff), ("a",)).pieces
        # forward and backward: the gain of one pass, squared; the bilinear transform warps frequency
        warp = lambda x: np.tan(np.pi * x * STEP)  # noqa: E731
        gain = 1 / (1 + (warp(f) / warp(cutoff)) ** 8)
        middle = slice(5000, -5000)
        x, y = piece.t[middle], piece.q[middle, 0]
        np.testing.assert_allclose(y, gain * np.sin(2 * np.pi * f * x), atol=1e-5)
        central = gain * np.cos(2 * np.pi * f * x) * np.sin(2 * np.pi * f * STEP) / STEP
        np.testing.assert_allclose(piece.qd[middle, 0], central, atol=1e-4 * 2 * np.pi * f)
        second = -gain * np.sin(2 * np.pi * f * x) * 4 * np.sin(np.pi * f * STEP) ** 2 / STEP**2
        np.testing.assert_allclose(piece.qdd[middle, 0], second, atol=1e-3 * (2 * np.pi * f) ** 2)


@pytest.mark.parametrize("spec", [PreprocessSpec(torque="same"), PreprocessSpec(filter="butterworth", torque="same")], ids=lambda s: s.filter)
def test_torque_sees_the_filter_that_the_angle_saw(spec):
    rng = np.random.default_rng(1)
    q = rng.normal(size=5000).cumsum() * 1e-3
    (piece,) = prepare([log(q)], spec, ("a",)).pieces
    np.testing.assert_allclose(piece.tau, piece.q, atol=1e-12)  # torque was a copy of the angle
    edge = piece.core.start
    assert edge == Smoother(spec, STEP).reach and len(piece.t) - piece.core.stop == edge


def test_standstill_leaves_out_rows_of_the_joint_that_stands():
    t = STEP * np.arange(8000)
    moving = np.sin(2 * np.pi * t)
    stopping = np.where((t > 2) & (t < 4), np.sin(4 * np.pi), np.sin(2 * np.pi * t))
    both = log(np.column_stack([moving, stopping]))
    (piece,) = prepare([both], PreprocessSpec(standstill=0.1), ("a", "b")).pieces
    still = (piece.t > 2.1) & (piece.t < 3.9)
    assert not piece.use[still, 1].any()
    assert 0.95 < piece.use[:, 0].mean() < 1.0  # only its own reversals
    assert prepare([both], PreprocessSpec(standstill="keep"), ("a", "b")).pieces[0].use is None
    (masked,) = prepare([both], PreprocessSpec(standstill="mask"), ("a", "b")).pieces
    assert not masked.use[still, 1].any() and masked.use[:, 0].mean() > 0.95
    # a filtered torque is touched as far as the filter reaches
    (wide,) = prepare([both], PreprocessSpec(standstill=0.1, torque="same"), ("a", "b")).pieces
    near = (wide.t > 1.975) & (wide.t < 2.0)
    assert not wide.use[near, 1].any()


AUTO = [PreprocessSpec(), PreprocessSpec(torque="same"), PreprocessSpec(filter="butterworth", cutoff=10.0)]


@pytest.mark.parametrize("spec", AUTO, ids=lambda s: f"{s.filter}-{s.torque}")
def test_what_the_filter_makes_of_friction_s_jump_is_left_out_and_little_else(spec):
    """qd = sin wt, three times as fast one way as the other: the acceleration jumps at every reversal, nowhere else."""
    t, w = STEP * np.arange(8000), 2 * np.pi
    half = np.floor(2 * t + 1e-9)  # half periods behind it, each of a known travel
    positive = half % 2 == 0
    travel = 3.0 * np.ceil(half / 2) - np.floor(half / 2)
    q = (travel * 2.0 + np.where(positive, 3.0, 1.0) * (np.where(positive, 1.0, -1.0) - np.cos(w * t))) / w
    qdd = w * np.cos(w * t) * np.where(positive, 3.0, 1.0)
    motion = prepare([log(q)], spec, ("a",))
    (piece,) = motion.pieces
    error = piece.qdd[:, 0] - np.interp(piece.t, t, qdd)
    if piece.smoother is not None:
        error = piece.smoother(error)
    error, use = error[piece.core], piece.use[piece.core, 0]
    rms = lambda e: np.sqrt(np.mean(e**2))  # noqa: E731
    assert rms(error[use]) < 0.05 * rms(error[~use])
    assert 2 * 14 * 0.02 / 8 < np.mean(~use) < 2 * 16 * (Smoother(spec, STEP).reach * STEP + 0.02) / 8
    assert motion.left_out[0] == np.count_nonzero(~use)


def test_a_stop_that_the_filter_hides_is_left_out_and_slow_motion_is_not():
    """A joint that stops for an instant and goes on: its filtered speed never comes to zero. One that creeps is told from one that stands."""
    t = STEP * np.arange(6000)
    dips = 2.0 * np.abs(t - 3.0)  # the speed, zero at 3 s
    q = np.cumsum(dips) * STEP
    creeps = 0.01 * t
    (piece,) = prepare([log(np.column_stack([q, creeps]))], PreprocessSpec(), ("a", "b")).pieces
    assert piece.qd[:, 0].min() > 1e-3
    assert not piece.use[np.abs(piece.t - 3.0) < 0.03, 0].any() and piece.use[np.abs(piece.t - 3.0) > 0.06, 0].all()
    assert piece.use[:, 1].all()


def test_behind_a_stand_rows_count_once_friction_has_settled():
    """A joint that stops and is let creep a tenth of a milliradian back and forth, for longer than the filter sees, before it goes on."""
    t = STEP * np.arange(6000)
    goes = lambda x: np.where(x > 0.0, x**2, 0.0)  # noqa: E731
    q = 0.5 - 0.3 * goes(2.0 - t) + 1e-4 * np.sin(2.0 * np.pi * np.clip(t - 2.0, 0.0, 2.0)) + 0.3 * goes(t - 4.0)
    (piece,) = prepare([log(q)], PreprocessSpec(), ("a",)).pieces
    stands = (piece.t > 2.0) & (piece.t < 4.0)
    creeps = stands & (np.abs(piece.qd[:, 0]) > 3e-4)
    assert creeps.sum() > 500 and not piece.use[stands, 0].any()
    # on its way again, it is used from 3e-4 rad on, as soon as the filter no longer sees the stand
    assert piece.use[piece.t > 4.1, 0].all() and piece.use[piece.t < 1.9, 0].all()


def test_encoder_noise_is_no_motion():
    """Where an angle travels less than its noise while the filter looks, nobody can say that it moves."""
    t = STEP * np.arange(8000)
    q = np.where(t < 3, 0.0, 0.5 * (1 - np.cos(2 * (t - 3)))) + 1e-4 * np.random.default_rng(0).normal(size=8000)
    (piece,) = prepare([log(q)], PreprocessSpec(), ("a",)).pieces
    assert not piece.use[piece.t < 2.9, 0].any()
    assert piece.use[np.abs(piece.qd[:, 0]) > 0.2, 0].all()


def test_a_joint_without_a_row_left_keeps_them_and_its_friction_is_held():
    """Rows that say nothing of friction still say what torque was needed."""
    t = STEP * np.arange(3000)
    rng = np.random.default_rng(1)
    trembles = 1e-3 * np.sin(2 * np.pi * 8 * t) + 1e-5 * rng.normal(size=3000)  # every window has a reversal in it
    motion = prepare([log(np.column_stack([np.sin(6 * t), trembles]))], PreprocessSpec(), ("a", "b"))
    (piece,) = motion.pieces
    assert motion.still == ("b",) and piece.use[:, 1].all() and motion.left_out[1] == 0
    assert 0 < motion.left_out[0] < len(piece.t)


def test_a_logged_velocity_is_taken_at_its_word():
    t = STEP * np.arange(3000)
    q, qd, qdd = np.sin(6 * t), 6 * np.cos(6 * t), -36 * np.sin(6 * t)
    made = Log("made", Path("made"), "", (Segment(t, STEP, q[:, None], q[:, None], qd[:, None], qdd[:, None], {}),))
    (piece,) = prepare([made], PreprocessSpec(filter="none"), ("a",)).pieces
    assert 0 < np.count_nonzero(~piece.use) < 30 and np.all(np.abs(piece.qd[~piece.use]) < 0.1)


def test_a_joint_that_never_moves_is_named():
    t = STEP * np.arange(1000)
    motion = prepare([log(np.column_stack([np.sin(6 * t), np.full(1000, 0.3)]))], PreprocessSpec(), ("a", "b"))
    assert motion.still == ("b",)


def test_what_cannot_be_filtered_is_said():
    with pytest.raises(LogError, match="window of 101"):
        prepare([log(np.zeros(60))], PreprocessSpec(), ("a",))
    with pytest.raises(ConfigError, match="samples at 1000 Hz"):
        prepare([log(np.zeros(600))], PreprocessSpec(window=0.002), ("a",))
    with pytest.raises(ConfigError, match="cutoff"):
        prepare([log(np.zeros(600))], PreprocessSpec(filter="butterworth", cutoff=600.0), ("a",))
    with pytest.raises(ConfigError, match="not logged"):
        prepare([log(np.zeros(600))], PreprocessSpec(filter="none"), ("a",))
    whole = log(np.zeros(600))
    short = Log("made", Path("made"), "", whole.segments + (Segment(np.arange(50) * STEP, STEP, np.zeros((50, 1)), np.zeros((50, 1)), None, None, {}),))
    with pytest.warns(SysidWarning, match="1 segment"):
        assert len(prepare([short], PreprocessSpec(), ("a",)).pieces) == 1


@pytest.mark.long
def test_auto_window_follows_the_noise_and_the_motion():
    """More encoder noise wants a wider window, and the choice is made on held-out stretches of the training log."""
    experiment, structure, _, _, prior = arm()
    rng = np.random.default_rng(2)
    chosen = {}
    for noise in (1e-6, 2e-3):
        made = arm_log(structure.robot, rng, seconds=20)
        (segment,) = made.segments
        noisy = replace(made, segments=(replace(segment, q=segment.q + noise * rng.normal(size=segment.q.shape)),))
        auto = experiment.model_copy(update={"preprocess": experiment.preprocess.model_copy(update={"window": "auto"})})
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SysidWarning)
            found = filters.compare(auto, structure, [noisy], prior)
        best = min(found["held_out"], key=lambda entry: entry["relative_error"])
        (mine,) = [entry for entry in found["held_out"] if entry["window"] == found["window"]]
        assert mine["relative_error"] < 1.02 * best["relative_error"] and found["chosen"] == "held-out error" and len(found["held_out"]) > 5
        chosen[noise] = found["window"]
    assert chosen[2e-3] > 2 * chosen[1e-6]


@pytest.mark.long
def test_a_low_pass_follows_the_noise_too():
    """What an angle's noise becomes as acceleration asks for a lower cutoff; torque is held against what was logged, so that none wins
    by what it smooths away. Where one is given, nothing is chosen."""
    experiment, structure, _, _, prior = arm()
    rng = np.random.default_rng(8)
    low = PreprocessSpec(torque="low-pass")
    experiment = experiment.model_copy(update={"preprocess": low})
    chosen = {}
    for noise in (1e-6, 2e-3):
        made = arm_log(structure.robot, rng, seconds=20)
        (segment,) = made.segments
        noisy = replace(made, segments=(replace(segment, q=segment.q + noise * rng.normal(size=segment.q.shape)),))
        found = filters.compare(experiment, structure, [noisy], prior)
        errors = {entry["cutoff"]: entry["relative_error"] for entry in found["held_out"]}
        assert errors[found["cutoff"]] < 1.1 * min(errors.values()) and found["chosen"] == "held-out error"
        # the angles' window goes with it
        assert found["window"] == pytest.approx(max(1.0 / (12.0 * found["cutoff"]), 4.0 * segment.step))
        chosen[noise] = found["cutoff"]
    assert chosen[2e-3] < 0.6 * chosen[1e-6]
    given = experiment.model_copy(update={"preprocess": PreprocessSpec(torque="low-pass", cutoff=4.0)})
    found = filters.compare(given, structure, [noisy], prior)
    assert (found["cutoff"], found["chosen"], found["held_out"]) == (4.0, "given", [])


def test_a_given_filter_is_shown_beside_half_and_double():
    experiment, structure, _, _, prior = arm()
    made = arm_log(structure.robot, np.random.default_rng(3), seconds=10)
    found = filters.compare(experiment, structure, [made], prior)
    assert found["window"] == 0.1 and found["chosen"] == "usual"
    said = experiment.model_copy(update={"preprocess": experiment.preprocess.model_copy(update={"window": 0.1})})
    assert filters.compare(said, structure, [made], prior) == {**found, "chosen": "given"}
    assert [entry["window"] for entry in found["held_out"]] == [0.05, 0.1, 0.2]
    assert all(0 < entry["relative_error"] < 1 for entry in found["held_out"])


def test_a_filter_that_leaves_a_coefficient_untold_wins_no_tie():
    """What a coupling of two joints rubs may differ from their own friction only near reversals, which a wide window leaves out."""
    one = lambda window, error, untold: {
        "window": window,
        "relative_error": error,
        "folds": [np.log(error) + x for x in np.random.default_rng(int(1e3 * window)).normal(0, 0.3, 4)],
        "untold": untold,
    }  # noqa: E731
    rest = [one(0.05, 0.066, 0), one(0.07, 0.067, 0)]  # they differ by less than by their scatter
    assert filters._best([*rest, one(0.1, 0.062, 0)], "window", 0.1)["window"] == 0.1
    assert filters._best([*rest, one(0.1, 0.062, 1)], "window", 0.1)["window"] == 0.07
    far = {**one(0.1, 0.01, 1), "folds": [-4.6] * 4}  # what is clearly better stays better
    assert filters._best([*rest, far], "window", 0.1)["window"] == 0.1


def test_candidates_are_judged_on_the_same_rows():
    """Without any noise in the angle no width may win by leaving out the edges."""
    experiment, structure, _, _, prior = arm()
    made = arm_log(structure.robot, np.random.default_rng(4), seconds=8)
    auto = experiment.model_copy(update={"preprocess": experiment.preprocess.model_copy(update={"window": "auto"})})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SysidWarning)
        found = filters.compare(auto, structure, [made], prior)
    assert found["window"] <= 0.2


def test_a_standing_joint_has_no_direction():
    """A constant encoder leaves rounding in the filtered velocity; its sign is no friction."""
    t = STEP * np.arange(6000)
    q = np.where(t < 2, 0.3, 0.3 + 0.2 * np.sin(2 * np.pi * (t - 2)))
    for spec in (PreprocessSpec(standstill="keep"), PreprocessSpec(standstill="keep", filter="butterworth", cutoff=20.0)):
        motion = prepare([log(np.column_stack([q, np.sin(t)]))], spec, ("a", "b"))
        (piece,) = motion.pieces
        dwell = piece.t < 1.5
        assert np.count_nonzero(piece.direction(0)[dwell]) == 0
        assert np.abs(piece.direction(0)[piece.t > 2.3]).mean() > 0.99
        np.testing.assert_array_equal(piece.direction(1), np.sign(piece.qd[:, 1]))
        assert motion.standing[0] > 0.25 and motion.standing[1] < 0.1


def test_a_joint_counts_no_less_for_the_rows_that_a_wide_window_leaves_out():
    """Two wrist joints rub on each other, and one of them lacks a torque: the wider the window, the fewer rows tell of it. Errors relative
    to each torque are in a geometric mean over the joints as ever."""
    experiment, structure, *_, prior = arm()
    turning = EffectSpec(name="joint_coupling", joints=["wrist_2_joint"], options={"other": "wrist_3_joint"})
    model = build(structure.robot, [*experiment.model.effects, turning])
    made = arm_log(structure.robot, np.random.default_rng(8), seconds=30.0, noise=0.02)
    (segment,) = made.segments
    tau = segment.tau + np.outer(segment.q[:, 5], [0.0, 0.0, 0.0, 0.0, 2.0, 0.0])
    logs = [replace(made, segments=(replace(segment, tau=tau),))]
    found = [held_out(experiment, PreprocessSpec(window=window), model, logs, prior, 0.2) for window in (0.05, 0.15)]
    mean = [np.mean(np.log([*one["rms"].values()])) for one in found]
    assert np.log(found[1]["relative_error"] / found[0]["relative_error"]) == pytest.approx(mean[1] - mean[0], abs=0.02)
