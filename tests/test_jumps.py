"""Jumps of accelerations are found, and the rows that the angles' filter bends about them do not count."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid.jumps import jumps
from sysid.log import Log, Segment
from sysid.motion import Blur
from sysid.preprocess import piece_of, prepare
from sysid.smoother import Smoother
from sysid.specs import PreprocessSpec

STEP, INERTIA, NOISE = 1e-3, 2.0, 0.02


def twice(qdd, step=STEP):
    """The angle (n,) that moves by accelerations which stay as they are from one sample to the next."""
    qd = np.concatenate([[0.0], np.cumsum(qdd)[:-1]]) * step
    return np.concatenate([[0.0], np.cumsum(qd + 0.5 * qdd * step)[:-1]]) * step


def moves(seconds: float = 12.0, period: float = 4.0, step=STEP):
    """An inertia from rest to rest, over and over: its torque is one of three levels, its angle the exact double integral."""
    t = np.arange(round(seconds / step)) * step
    phase = (t / period) % 1.0
    level = np.select([phase < 0.125, phase < 0.375, phase < 0.5, phase < 0.625, phase < 0.875], [1, 0, -1, -1, 0], 1)
    qdd = 6.0 * (4.0 / period) ** 2 * level
    return t, twice(qdd, step), qdd


def log_of(t, q, tau):
    columns = [np.reshape(own, (len(t), -1)) for own in (q, tau)]
    return Log("moves", Path("moves"), "", (Segment(t, t[1] - t[0], *columns, None, None, {}),))


def motion(tau, q, t, **spec):
    return prepare([log_of(t, q, tau)], PreprocessSpec(**spec), tuple("abc")[: np.reshape(q, (len(t), -1)).shape[1]])


def found(t, q, tau, **spec):
    """Rows (n, dof) that are bent about jumps, and their times, where every row counts."""
    log, spec = log_of(t, q, tau), PreprocessSpec(**spec)
    piece = piece_of(0, log, log.segments[0], spec, ("a", "b"))
    smoother = Smoother(spec, piece.step)
    piece = replace(piece, blur=Blur(*smoother.smear(piece.smoother is not None), smoother.reach))
    (rows,) = jumps([piece], [smoother], [np.ones(piece.q.shape, dtype=bool)])
    return rows, piece.t


def error(of) -> float:
    """RMS of what the true inertia leaves of the rows that count."""
    (piece,) = of.pieces
    use = np.ones(piece.q.shape, bool) if piece.use is None else piece.use
    rest = piece.tau - INERTIA * (piece.qdd if piece.smoother is None else piece.smoother(piece.qdd))
    return float(np.sqrt(np.mean(rest[piece.core][use[piece.core]] ** 2)))


def test_the_true_model_leaves_the_noise_where_an_acceleration_jumps():
    t, q, qdd = moves()
    tau = INERTIA * qdd + NOISE * np.random.default_rng(0).normal(size=len(t))
    assert error(motion(tau, q, t, standstill="keep")) > 20.0 * NOISE  # what the filter bends
    kept = motion(tau, q, t)
    assert error(kept) == pytest.approx(NOISE, rel=0.1)
    # a jump or a reversal every half or whole second, and no more about each than the filter sees
    (piece,) = kept.pieces
    assert 1.0 - piece.use.mean() < 18 * 0.1 / 12.0 + 0.01


@pytest.mark.parametrize("after", [0.02, 0.06, 0.09])
@pytest.mark.parametrize("end", [1, -1])
def test_a_jump_at_an_end_of_a_log_is_left_out_too(after, end):
    """Half of its wave is in the log, or less: an acceleration that jumped 0.1 s before the end was nine tenths of a control's error."""
    t, q, qdd = moves(11.5 + after)
    tau = (INERTIA * qdd + NOISE * np.random.default_rng(0).normal(size=len(t)))[::end]
    assert error(motion(tau, q[::end], t)) == pytest.approx(NOISE, rel=0.1)


@pytest.mark.parametrize("samples", [-28, -15, -4, 0, 12, 25])
def test_torque_that_is_logged_late_is_left_out_late(samples):
    """As long as a delay may be; what the true model, delayed, leaves is the noise."""
    t, q, qdd = moves()
    late = np.roll(qdd, samples)
    tau = INERTIA * late + NOISE * np.random.default_rng(0).normal(size=len(t))
    (piece,) = motion(tau, q, t).pieces
    kept = slice(piece.core.start + 30, piece.core.stop - 30)
    rest = (piece.tau[:, 0] - INERTIA * np.roll(piece.qdd[:, 0], samples))[kept][piece.use[kept, 0]]
    assert np.sqrt(np.mean(rest**2)) == pytest.approx(NOISE, rel=0.1)
    # no more goes than of torque that is in time, but for where the joint turns round
    assert 1.0 - piece.use.mean() < 18 * 0.1 / 12.0 + 0.03


@pytest.mark.parametrize("rate", [100.0, 250.0, 1000.0])
@pytest.mark.parametrize("filtered, period", [("savitzky-golay", 1.0), ("butterworth", 4.0)])
def test_moves_so_short_that_half_of_the_rows_are_bent(rate, filtered, period):
    """What is usual in such a log is a jump."""
    t, q, qdd = moves(12.0, period, 1.0 / rate)
    rng = np.random.default_rng(3)
    tau, q = INERTIA * qdd + 0.2 * rng.normal(size=len(t)), q + 1e-6 * rng.normal(size=len(t))
    kept = motion(tau, q, t, filter=filtered)
    assert 0.3 < kept.pieces[0].use.mean() < 0.7
    assert error(motion(tau, q, t, filter=filtered, standstill="keep")) > 3.0 * 0.2
    assert error(kept) < 1.05 * 0.2


def test_a_filter_on_both_sides_bends_less():
    t, q, qdd = moves()
    tau = INERTIA * qdd + NOISE * np.random.default_rng(0).normal(size=len(t))
    before, after = (motion(tau, q, t, torque="same", standstill=how) for how in ("keep", "auto"))
    white = NOISE * np.sqrt(np.sum(before.pieces[0].smoother(np.eye(201))[:, 100] ** 2))
    assert error(before) > 10.0 * white and error(after) < 1.6 * white


def waves(rng, t):
    """Accelerations of six sines that go up to 3 Hz, and the angle that they are of."""
    each = [(rng.normal(), 2.0 * np.pi * rng.uniform(0.2, 3.0), rng.uniform(0.0, 6.0)) for _ in range(6)]
    return sum(a * np.sin(w * t + p) for a, w, p in each), sum(-a * np.sin(w * t + p) / w**2 for a, w, p in each)


def test_a_smooth_motion_with_noise_does_not_jump():
    rng, t = np.random.default_rng(1), np.arange(5000) * STEP
    hit = 0
    for _ in range(200):
        qdd, q = np.transpose([waves(rng, t) for _ in range(2)], (1, 2, 0))
        q = q + 10 ** rng.uniform(-7.0, -4.0) * rng.normal(size=q.shape)
        tau = 20.0 * qdd + rng.uniform(0.2, 2.0) * rng.normal(size=q.shape)
        hit += bool(found(t, q, tau)[0].any())
    assert hit <= 8  # one log in a hundred is allowed one: more than eight of 200 is a chance of 1e-3


def test_a_jump_of_several_deviations_is_found_in_its_place():
    rng, t, places = np.random.default_rng(2), np.arange(8000) * STEP, (2.0, 5.1)
    qdd = np.sum([t >= place for place in places], axis=0) * 0.3
    tau = INERTIA * qdd + 0.1 * rng.normal(size=len(t))
    rows, times = found(t, twice(qdd) + 1e-7 * rng.normal(size=len(t)), tau)
    apart = np.min([np.abs(times[rows[:, 0]] - place) for place in places], axis=0)
    assert all(np.abs(times[rows[:, 0]] - place).min() <= 5 * STEP for place in places) and apart.max() <= 0.05


def test_a_jump_bends_the_joints_whose_torque_it_makes():
    """The second joint's acceleration jumps, and makes torque of both; the first's does not."""
    rng, t = np.random.default_rng(4), np.arange(8000) * STEP
    own, q = waves(rng, t)
    other = 3.0 * (((t / 1.5) % 1.0) < 0.5)
    q = np.stack([q, twice(other)], axis=1)
    for coupled, said in ((0.5, True), (0.0, False)):
        tau = np.stack([INERTIA * own + coupled * other, coupled * own + INERTIA * other], axis=1)
        rows, _ = found(t, q, tau + 0.05 * rng.normal(size=tau.shape))
        assert rows[:, 0].any() == said and rows[:, 1].any()


def test_a_jump_that_is_nothing_beside_the_noise_is_kept():
    rng = np.random.default_rng(5)
    t, q, qdd = moves()
    tau = INERTIA * qdd + 8.0 * rng.normal(size=len(t))
    assert not found(t, q, tau)[0].any()


def test_what_moves_a_torque_alone_is_no_jump():
    """A spike, a step of friction, cogging, a coarse torque."""
    rng, t = np.random.default_rng(6), np.arange(6000) * STEP
    qdd, q = waves(rng, t)
    base = INERTIA * qdd + 0.1 * rng.normal(size=len(t))
    spiky = base.copy()
    spiky[[1000, 1001, 3000]] += 30.0
    steps = base + 3.0 * (((t / 0.7) % 1.0) < 0.5)
    cogging = base + 2.0 * np.sin(40.0 * q)
    for tau in (spiky, steps, cogging, np.round(base / 0.5) * 0.5, np.zeros(len(t))):
        assert not found(t, q, tau)[0].any()


def test_a_short_log_has_none():
    t, q, qdd = moves()
    assert not found(t[:300], q[:300], INERTIA * qdd[:300])[0].any()


@pytest.mark.parametrize("samples", [0, 9])
@pytest.mark.parametrize("posture", [lambda q: 2.5 + 1.5 * np.cos(q), lambda q: 1.2 + np.cos(q), np.cos], ids=["1 to 4", "0.2 to 2.2", "turns its sign"])
def test_an_inertia_that_depends_on_the_posture(posture, samples):
    """Of the joint itself, or of a coupling with the other: what the whole log has on average is not what a jump has; nor is it where
    torque is logged late."""
    rng = np.random.default_rng(7)
    t, other, qdd = moves(24.0)
    own, q = waves(rng, t)
    q, slow = np.stack([q, 0.1 * other], axis=1), 3.0 * np.sin(0.9 * t)
    tau = np.stack([INERTIA * own + 0.1 * posture(slow) * qdd, 0.1 * qdd], axis=1)
    tau = np.roll(tau, samples, axis=0) + NOISE * rng.normal(size=q.shape)
    (piece,) = motion(tau, q, t).pieces
    rest = piece.measured[:, 0] - np.roll(INERTIA * piece.qdd[:, 0] + posture(3.0 * np.sin(0.9 * piece.t)) * piece.qdd[:, 1], samples)
    rest, use = rest[samples + 1 :], piece.use[samples + 1 :, 0]
    rms = lambda rows: float(np.sqrt(np.mean(rest[rows] ** 2)))  # noqa: E731
    assert rms(slice(None)) > 1.5 * NOISE and rms(use) < 1.1 * NOISE


@pytest.mark.parametrize(("inertia", "said"), [(0.3, True), (0.003, False)])
def test_a_torque_that_follows_an_acceleration_by_far_less_than_inertia_does_is_no_jump(inertia, said):
    """A light motor whose ripple and controller move both, with friction and a load that are all its torque; in time and late."""
    rng = np.random.default_rng(13)
    t, q, qdd = moves()
    slow = 5.0 * np.sin(1.3 * t) * np.sign(np.sin(0.7 * t) + 1.5)
    for late in (0, 8):
        rows, _ = found(t, q, slow + inertia * np.roll(qdd, late) + 1e-4 * rng.normal(size=len(t)))
        assert bool(rows.any()) is said


@pytest.mark.parametrize("filtered", ["savitzky-golay", "butterworth"])
def test_the_ends_of_a_smooth_motion_are_no_jumps(filtered):
    """Where a filter sees one side only it takes something away of any motion that bends."""
    rng, t = np.random.default_rng(8), np.arange(4000) * STEP
    for frequency in (1.0, 2.0, 4.0):
        for phase in rng.uniform(0.0, 2.0 * np.pi, 5):
            swing = 10.0 * np.sin(2.0 * np.pi * frequency * t + phase)
            tau = INERTIA * swing + NOISE * rng.normal(size=len(t))
            q = -swing / (2.0 * np.pi * frequency) ** 2 + 1e-7 * rng.normal(size=len(t))
            assert not found(t, q, tau, filter=filtered)[0].any()


@pytest.mark.parametrize("filtered", ["savitzky-golay", "butterworth"])
def test_a_row_that_both_sides_saw_filtered_has_less_noise(filtered):
    """By as much a smaller jump counts."""
    rng, t = np.random.default_rng(9), np.arange(8000) * STEP
    qdd = 0.2 * (((t / 2.0) % 1.0) < 0.5)
    tau = INERTIA * qdd + 0.02 * rng.normal(size=len(t))
    spec = {"torque": "same", "filter": filtered}
    before, after = (motion(tau, twice(qdd), t, standstill=how, **spec) for how in ("keep", "auto"))
    (piece,) = before.pieces
    white = 0.02 * np.sqrt(np.sum(piece.smoother(np.eye(2001))[:, 1000] ** 2))
    assert error(before) > 1.3 * white and error(after) < 1.15 * white


@pytest.mark.parametrize(("bits", "used"), [(12, 0.74), (13, 0.74)])
def test_a_jump_that_a_coarse_encoder_hides_is_told_by_the_torque(bits, used):
    """Of 12 bits most accelerations jump by less than what noise makes in some row of the log, and the torque shows each. No more goes
    than where the encoder shows them."""
    t, q, qdd = moves(24.0, 4.0, 0.004)
    grain, rng = 2.0 * np.pi / 2**bits, np.random.default_rng(2)
    tau = INERTIA * qdd + 0.3 * rng.normal(size=len(t))
    kept = motion(tau, np.round(q / grain) * grain, t, window=0.2)
    (piece,) = kept.pieces
    rest = (piece.tau - INERTIA * piece.qdd)[piece.core][piece.use[piece.core]]
    assert np.sqrt(np.mean(rest**2)) < 1.1 * np.median(np.abs(rest)) / 0.6745  # no tail: 2.1 times that, were the jumps in it
    assert piece.use[piece.core].mean() == pytest.approx(used, abs=0.03)


@pytest.mark.parametrize("gaps", [(0.02, 0.06), (0.04, 0.1), (0.06, 0.14)])
def test_of_jumps_within_a_window_each_bends_the_torque(gaps):
    """Three joints set off one after another, and each feels the others, a fourth all of them: no wave is most of what its torque does.
    What the true model leaves is its noise; were they told one by one it would be up to nine times that."""
    rng, t = np.random.default_rng(1), np.arange(24000) * STEP
    starts = np.arange(1.0, 23.0, 2.0)
    later, way = np.cumsum(rng.uniform(*gaps, (2, len(starts))), axis=0), np.resize([3.0, -3.0], len(starts))
    own = [sum(by * (t >= at) for by, at in zip(ways, starts + late)) for ways, late in ((way, 0.0), (way, later[0]), (-way, later[1]))]
    qdd = np.stack([*own, 0.0 * t], axis=1) + 2.0 * np.sin(2.0 * np.pi * np.outer(t, [0.3, 0.4, 0.5, 0.6]))
    inertia = np.array([[2.0, 0.3, -0.4, -1.0], [0.3, 2.0, 0.2, 1.1], [-0.4, 0.2, 1.5, 0.9], [-1.0, 1.1, 0.9, 0.5]])
    log = log_of(t, np.stack([twice(one) for one in qdd.T], axis=1), qdd @ inertia + NOISE * rng.normal(size=qdd.shape))
    (piece,) = prepare([log], PreprocessSpec(window=0.2), tuple("abcd")).pieces
    rest, use = (piece.tau - piece.qdd @ inertia)[piece.core], piece.use[piece.core]
    assert [np.sqrt(np.mean(own[at] ** 2)) for own, at in zip(rest.T, use.T)] == pytest.approx(4 * [NOISE], rel=0.1)
    assert use.mean() > 0.5
