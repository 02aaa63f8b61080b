"""The time of samples: read off all joints together where stamps are late or early, left alone where they are right."""

import numpy as np
import pytest

from sysid.clock import corrected
from sysid.frequencies import low

STEP = 0.01


def motion(t, seed=0, dof=3):
    """Angles (n, dof): sines below 2 Hz."""
    rng = np.random.default_rng(seed)
    w, a, p = 2.0 * np.pi * rng.uniform(0.1, 2.0, (5, 1, dof)), rng.uniform(0.05, 0.4, (5, 1, dof)), rng.uniform(0.0, 6.0, (5, 1, dof))
    return np.sum(a * np.sin(w * t[None, :, None] + p), axis=0)


def taken(seed=0, n=2000):
    """The instants of a slow logger, early and late."""
    rng = np.random.default_rng(seed)
    return STEP * np.arange(n) + np.clip(2e-3 * rng.standard_normal(n), -4e-3, 4e-3)


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


@pytest.mark.parametrize("dof", [1, 3])
@pytest.mark.parametrize("seed", [0, 1])
def test_values_older_than_their_stamps_are_put_where_they_belong(seed, dof):
    """Half of the samples are a millisecond old, as a logger has them that wakes up between two control periods."""
    instants = taken(seed)
    off = 1e-3 * np.random.default_rng(seed + 7).integers(0, 2, len(instants))
    q = motion(instants - off, seed, dof)
    clock = corrected(instants, q)
    found, told = clock.t, clock.off
    t = instants - off
    # as angles: where nothing moves, the time does not matter; and that all are late by the same, no angle tells
    speed = np.gradient(q, t, axis=0)[50:-50]
    angle = lambda late: (late - late.mean())[50:-50, None] * speed  # noqa: E731
    assert rms(angle(found - t)) < 0.4 * rms(angle(off))  # what is as slow as the motion itself stays
    assert rms(np.diff(angle(found - t), 2, axis=0)) < 0.1 * rms(np.diff(angle(off), 2, axis=0))  # what makes accelerations does not
    assert 2e-4 < told < 8e-4
    assert np.all(np.diff(found) > 0)


def test_even_stamps_are_doubted_where_joints_agree():
    """A logger that writes an even time, whenever it took its samples; against noise of each joint's own that grows with its speed."""
    rng = np.random.default_rng(11)
    stamps = STEP * np.arange(2000)
    off = 6e-4 * rng.standard_normal(len(stamps))
    clock = corrected(stamps, motion(stamps + off, 4), written=False)
    assert 3e-4 < clock.off < 8e-4 and rms(np.diff(clock.t - stamps - off, 2)) < 0.3 * rms(np.diff(off, 2))
    q = motion(stamps, 4)
    own = np.gradient(q, stamps, axis=0) * 6e-4 * rng.standard_normal(q.shape)
    assert corrected(stamps, q + own).off > 3e-4  # stamps that vary would be taken at that word
    assert corrected(stamps, q + own, written=False).off == 0.0
    grain = 2.0 * np.pi / 2**12
    for coarse in (np.round(q / grain) * grain, q[:, :1] + own[:, :1]):
        assert corrected(stamps, coarse, written=False).off == 0.0


def test_of_samples_seconds_apart_no_clock_is_told():
    stamps = 2.0 * np.arange(400)
    for written in (True, False):
        assert corrected(stamps, motion(0.01 * stamps), written=written).off == 0.0


def test_a_clock_that_is_right_stays_as_it_is():
    """Angles with a little noise of their own: what moves the stamps is less than what the noise is worth in time."""
    instants = taken(3)
    rng = np.random.default_rng(3)
    q = motion(instants, 3)
    for noise in (0.0, 1e-5, 3e-4):
        clock = corrected(instants, q + noise * rng.standard_normal(q.shape))
        found, told = clock.t, clock.off
        speed = np.gradient(q, instants, axis=0)
        worth = noise / np.sqrt(np.mean(np.sum(speed**2, axis=1)))
        assert rms(found - instants) <= 0.3 * worth + 1e-6 and told <= 0.3 * worth + 1e-6


def test_moves_with_stops_do_not_move_the_clock_at_rest():
    """Corners of the motion are no time: where nothing moves, and where it starts to, stamps stay within the clock's errors."""
    instants = taken(5, 3000)
    off = 1e-3 * np.random.default_rng(9).integers(0, 2, len(instants))
    t = instants - off
    phase = np.clip((t % 3.0) / 1.2, 0.0, 1.0)  # moves of 1.2 s, stops of 1.8 s, there and back
    way = 10.0 * phase**3 - 15.0 * phase**4 + 6.0 * phase**5
    q = np.where((t // 3.0) % 2 == 0, way, 1.0 - way)[:, None] * [1.0, 0.4, 0.0]
    found = corrected(instants, q).t
    assert np.abs(found - instants).max() < 3e-3
    fast = (phase > 0.3) & (phase < 0.7)
    error = (found - t)[fast]
    assert rms(error - error.mean()) < 2.5e-4


def test_short_logs_and_still_ones_are_left_alone():
    instants = taken(0, 2000)
    for t, q in ((instants[:150], motion(instants[:150])), (instants, np.zeros((2000, 2)))):
        clock = corrected(t, q)
        assert clock.off == 0.0 and np.array_equal(clock.t, t) and clock.at(t, STEP) is None


def moved(t):
    """Angles (n, 2): slow sines, and in the middle a move of a fifth of a second whose acceleration jumps."""
    slow = np.stack([0.4 * np.sin(0.9 * t), 0.6 * np.sin(0.7 * t + 1.0)], axis=1)
    since = np.clip(t - 10.0, 0.0, 0.2)
    way = np.where(since < 0.1, 0.5 * 60.0 * since**2, 0.6 - 0.5 * 60.0 * (0.2 - since) ** 2)
    return slow + way[:, None] * [1.0, 0.3]


def test_a_short_fast_move_is_no_clock():
    """Its corners stand above the frequency below which the rest of the log moves: there the clock is read off what is faster still."""
    instants = taken(4)
    off = 1e-3 * np.random.default_rng(11).integers(0, 2, len(instants))
    t = instants - off
    clock = corrected(instants, moved(t))
    error = clock.t - t
    near = (t > 9.95) & (t < 10.25)
    assert rms((error - error.mean())[near]) < 7e-4  # what stamps are off by is 5e-4
    assert rms((error - error.mean())[~near]) < 2.5e-4
    assert np.median(clock.below[near]) > 2.0 * np.median(clock.below[~near])


def test_what_no_angle_told_of_the_clock_is_drawn_again():
    """As large as what is left in the stamps, in each band below the frequency above which they were read off."""
    left, drawn = [], []
    for seed in range(6):
        instants = taken(seed)
        off = 1e-3 * np.random.default_rng(seed + 20).integers(0, 2, len(instants))
        clock = corrected(instants, motion(instants - off, seed))
        assert clock.deviation == pytest.approx(5e-4, rel=0.2)
        error = clock.t - (instants - off)
        even = STEP * np.arange(len(instants))
        again = clock.at(even, STEP).drawn(np.random.default_rng(seed))
        spectrum = lambda e: np.abs(np.fft.rfft((e - e.mean()) * np.hanning(len(e)))) ** 2  # noqa: E731
        left.append(spectrum(error)), drawn.append(spectrum(again))
    frequency = np.fft.rfftfreq(len(instants), STEP)
    for least, most in ((0.5, 1.5), (1.5, 3.0)):
        here = (frequency > least) & (frequency < most)
        assert np.mean(np.array(drawn)[:, here]) == pytest.approx(np.mean(np.array(left)[:, here]), rel=0.5), (least, most)


def test_what_the_angles_told_badly_is_drawn_again_where_it_stands():
    """Motion that the low-pass leaves is slow: little of what is drawn beside it is fast."""
    left, drawn = [], []
    for seed in range(6):
        instants = taken(seed)
        t = instants - 1e-3 * np.random.default_rng(seed + 20).integers(0, 2, len(instants))
        clock, even = corrected(instants, motion(t, seed)), STEP * np.arange(len(instants))
        again = clock.at(even, STEP).drawn(np.random.default_rng(seed))
        spectrum = lambda e: np.abs(np.fft.rfft((e - e.mean()) * np.hanning(len(e)))) ** 2  # noqa: E731
        left.append(spectrum(clock.t - t)), drawn.append(spectrum(again))
    frequency = np.fft.rfftfreq(len(instants), STEP)
    for least, most in ((3.0, 5.0), (20.0, 30.0), (30.0, 48.0)):
        here = (frequency > least) & (frequency < most)
        assert 0.5 < np.mean(np.array(drawn)[:, here]) / np.mean(np.array(left)[:, here]) < 2.0, (least, most)


@pytest.mark.parametrize("seed", range(3))
def test_at_the_ends_of_a_log_its_clock_is_not_told(seed):
    """What stays in the stamps there is fast, and makes several times the acceleration that it makes elsewhere: these rows are few."""
    instants = taken(seed, 500)
    t = instants - 1e-3 * np.random.default_rng(seed + 20).integers(0, 2, len(instants))
    clock = corrected(instants, motion(t, seed))
    left = clock.at(instants, STEP)
    rows = left.inside
    assert 5 <= rows.start <= 40 and 5 <= len(t) - rows.stop <= 40
    bent = np.diff(low(clock.t - t, 15.0, STEP), 2)  # what a torque sees of it
    assert rms(np.r_[bent[: rows.start], bent[rows.stop - 2 :]]) > 2.5 * rms(bent[rows.start : rows.stop - 2])
    own = left.of(rows)
    assert len(own.below) == own.doubt.shape[1] == rows.stop - rows.start


@pytest.mark.parametrize("seed", range(3))
def test_no_more_than_a_period_is_cut_off_where_a_log_begins_quickly(seed):
    """Three seconds of 8 Hz at the start are motion, though its clock is read off what is faster there."""
    instants = taken(seed)
    t = instants - 1e-3 * np.random.default_rng(seed + 20).integers(0, 2, len(instants))
    quick = 0.02 * np.sin(2.0 * np.pi * 8.0 * t) * np.clip((3.0 - t) / 0.3, 0.0, 1.0)
    left = corrected(instants, motion(t, seed) + quick[:, None]).at(instants, STEP)
    assert np.all(left.below[:200] > 2.0 * np.median(left.below))
    assert left.inside.start * STEP <= 0.6 and (len(t) - left.inside.stop) * STEP <= 0.6


def stopping(t, seed):
    """Angles (n, 3): moves of half a second to a second and a half, with stops in between."""
    rng = np.random.default_rng(seed)
    out = np.zeros((len(t), 3))
    for j in range(3):
        at = 0.0
        while at < t[-1]:
            way, took = rng.uniform(-1.2, 1.2), rng.uniform(0.5, 1.5)
            s = np.clip((t - at) / took, 0.0, 1.0)
            out[:, j] += way * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
            at += took + rng.uniform(0.0, 1.0)
    return out


@pytest.mark.parametrize("moves", [motion, stopping])
def test_what_is_left_of_the_clock_is_foreseen_in_accelerations(moves):
    """Moves that the clock is not told from, and joints too slow to tell it, leave more of it: what is drawn again is about as large
    where it counts, below 15 Hz in accelerations."""
    left, drawn = [], []
    for seed in range(6):
        instants = taken(seed)
        t = instants - 1e-3 * np.random.default_rng(seed + 20).integers(0, 2, len(instants))
        q = moves(t, seed)
        clock, speed = corrected(instants, q), np.gradient(q, t, axis=0)
        felt = lambda late: np.diff(low((late - np.median(late))[:, None] * speed, 15.0, STEP), 2, axis=0)[50:-50]  # noqa: E731, B023
        left.append(np.mean(felt(clock.t - t) ** 2))
        drawn.append(np.mean(felt(clock.at(STEP * np.arange(len(t)), STEP).drawn(np.random.default_rng(seed))) ** 2))
    assert 0.5 < np.sqrt(np.mean(left) / np.mean(drawn)) < 1.4
