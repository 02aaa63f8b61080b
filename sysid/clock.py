"""When samples were really taken: what all joints show together of stamps that are late or early.

A logger that writes the time at which it woke up, and values from a while before, puts its samples
beside their time. Of a joint at 3 rad/s half a millisecond makes 1.5 mrad, and of that a second
difference makes torque by the newton metre. But all joints are off by the same time: their angles
stand beside a smooth motion by their speeds times it, and that tells it.

    q_j(k) - smooth_j(t_k) = speed_j(t_k) e_k + own noise_j        for each sample k and joint j

How large e and the noises are is read off the log: squares that grow with the square of the speed
are the clock's, the rest is the angles' own. With these, e_k is its mean given all joints
(a weighted mean, drawn towards zero). A clock that is right has no e, and stays as it is.

Source: variance components by least squares; Robinson 1991 (best linear unbiased prediction).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .frequencies import low
from .running import running

_HIGHEST = 0.25  # of the sampling rate: the last frequency below which a motion may stay
_LOWEST = 2.0  # Hz
_FINER = 0.8  # from one frequency tried to the next
# Of the density above the highest frequency. Errors of two values (on time, or late by one period)
# have 2.2 times a normal variable's median; above a high frequency they look normal.
_WHITE = 2.5
# Of the power that the clock makes, what else may stand in the angles: a twentieth in amplitude.
# A third of it, or three times as much, leaves nearly the same errors.
_LITTLE = 0.0025
_SCATTER = 3.0  # samples' share: of few, no power is known better
# Of the largest square in a joint's bins: what is less, corners of the motion make at a standstill
_LEAST = 0.01
_BINS, _ROUNDS, _FEWEST = 20, 3, 200
_MEDIAN = 0.4549  # of a squared normal variable
_MOST = 3.0  # deviations of the clock
# Times what the clock makes of a band: twice, half of it is motion, and to take it for the clock's
# costs as much as to leave the clock's (Mallows 1973)
_MOTION = 2.0
_ENDS = 2.0  # times the usual frequency: the errors' part of an acceleration is six times as large
_ORDERED = 0.45  # of the way to a neighbour: samples keep their order
_SAME = 0.999  # correlation of speeds: joints that move in proportion
_AGREED = 0.5  # of a clock's power, that different joints must agree on where stamps say nothing


@dataclass(frozen=True)
class Clock:
    """When samples were taken: t (n,) [s]; off: RMS [s] by which their stamps were off, zero where
    they were right; deviation [s] of one stamp's error; bands (m,) [Hz], falling: the frequencies
    above which errors were read off; below (n,): of these, the one about each sample. What is
    slower than that is left in t, and of what is faster, between each band and the one above it,
    the share `doubt` (m, n) of its power: of slow joints no angle tells much."""

    t: np.ndarray
    off: float = 0.0
    deviation: float = 0.0
    bands: tuple[float, ...] = ()
    below: np.ndarray | None = None
    doubt: np.ndarray | None = None

    def at(self, t, step: float) -> Left | None:
        """What is left of the errors at times t (m,) [s] a `step` apart; None where none is."""
        if self.below is None:
            return None
        nearest = np.searchsorted(0.5 * (self.t[1:] + self.t[:-1]), t)
        doubt = self.doubt[:, nearest]
        return Left(self.deviation, self.bands, self.below[nearest], doubt, step)


@dataclass(frozen=True)
class Left:
    """Errors of a clock that no angle told: those of stamps `step` [s] apart, white and of RMS
    `deviation` [s], as far as they stay below the frequencies `below` (n,) [Hz], and of what is
    faster, between each of `bands` (m,) [Hz] and the one above it, the share `doubt` (m, n) of the
    power."""

    deviation: float
    bands: tuple[float, ...]
    below: np.ndarray
    doubt: np.ndarray
    step: float

    @property
    def inside(self) -> slice:
        """The rows between a log's ends, at which its motion is not told from its clock: the errors
        that are left there are faster, and of torque there is by the fifth power of that more. An
        end is no longer than a period of the usual frequency: beyond that it is the motion that is
        fast."""
        usual, rows = float(np.median(self.below)), len(self.below)
        known, most = np.flatnonzero(self.below <= _ENDS * usual), round(1.0 / (usual * self.step))
        return slice(min(int(known[0]), most), max(int(known[-1]) + 1, rows - most))

    @property
    def fast(self) -> np.ndarray:
        """(n,) bool: rows about which the motion was fast, so that little of the clock's errors was
        read off: what is left of them is faster than elsewhere, as at a log's ends."""
        return self.below > _ENDS * float(np.median(self.below))

    @property
    def spread(self) -> float:
        """How far to either side [s] what all joints did at once may have been spread: half a period
        of the usual frequency above which errors were read off."""
        return 0.5 / float(np.median(self.below))

    def of(self, rows: slice) -> Left:
        """Of some of the rows."""
        return replace(self, below=self.below[rows], doubt=self.doubt[:, rows])

    def drawn(self, rng: np.random.Generator) -> np.ndarray:
        """Such errors (n,) [s], once more."""
        faster = self.deviation * rng.standard_normal(len(self.below))
        out = np.zeros(len(faster))
        for band, doubt in zip(self.bands, self.doubt):
            slower = low(faster, band, self.step)
            out += np.where(self.below <= band, np.sqrt(doubt), 1.0) * (faster - slower)
            faster = slower
        return out + faster


def corrected(t: np.ndarray, q: np.ndarray, *, written: bool = True) -> Clock:
    """When samples of angles q (n, dof) with stamps t (n,) [s] were taken; as these say, where the
    angles do not tell.

    Args:
        t: (n,) [s], ascending, without a gap.
        written: the stamps vary. Of a logger that writes an even time whatever the clock was,
            another one is believed where different joints agree on it.
    """
    step = float(np.median(np.diff(t)))
    moves = np.ptp(q, axis=0) > 1e-3 * np.ptp(q, axis=0).max()
    q = q[:, moves]
    if len(t) < _FEWEST or not moves.any():
        return Clock(t)
    bands, density = _bands(t, q, step)
    if not bands or not (written or _agreed(t, q, bands[0])):
        return Clock(t)
    room = _ORDERED * np.diff(t, prepend=t[0] - step, append=t[-1] + step)
    late = np.zeros(len(t))
    for _ in range(_ROUNDS):
        even = _evenly(t + late, q)
        told = [_late(t, q, late, even, band) for band in bands]
        late, below = _lowest(t, [found for found, _ in told], bands, density, step)
        late = np.clip(late, -room[:-1], room[1:])
        late[[0, -1]] = 0.0
    off, deviation = float(np.sqrt(np.mean(late**2))), float(np.sqrt(density))
    doubt = _by_band([doubt for _, doubt in told], [_kept(band * step) for band in bands])
    return Clock(t + late, off, deviation, tuple(bands), below, doubt)


def _agreed(t, q, frequency: float) -> bool:
    """Whether the clock's power above a frequency is that of products of different joints. Noise of
    the angles that grows with their speeds, a coarse encoder's at low speed, is each joint's own,
    and has no mean product with another's: where joints have encoders of their own. Of joints that
    move in proportion one counts."""
    beside, speed = _beside(t, q, _evenly(t, q), frequency)
    alike = np.abs(np.corrcoef(speed.T)) if speed.shape[1] > 1 else np.ones((1, 1))
    own = [j for j in range(len(alike)) if not np.any(alike[j, :j] > _SAME)]
    beside, speed = beside[:, own], speed[:, own]
    noise, off = _components(beside, speed)
    if not off > 0.0:
        return False
    weight = 1.0 / np.maximum(noise, _LEAST * off * np.max(speed**2, axis=0))
    late, told = beside * speed * weight, speed**2 * weight
    of_others = lambda x: float(np.sum(np.sum(x, axis=1) ** 2 - np.sum(x**2, axis=1)))  # noqa: E731
    return of_others(late) > _AGREED * off * of_others(told) > 0.0


def _by_band(doubt: list[np.ndarray], kept: list[float]) -> np.ndarray:
    """The share (m, n) of the errors' power that is in doubt between each band and the one above
    it, of the shares (n,) of all that is above each: what is left of motion is slow."""
    power = np.array(doubt) * np.array(kept)[:, None]
    between = np.diff(kept, prepend=0.0)[:, None]
    return np.clip(np.diff(power, axis=0, prepend=0.0) / between, 0.0, 1.0)


def _lowest(t, told: list[np.ndarray], bands: list[float], density: float, step: float):
    """How late samples were (n,) [s], of what each band told, and above which frequency (n,) [Hz]
    that was read off: the lowest that has forgotten the log's ends and above which little moves
    near a sample.

    A short fast move, too seldom to count in the whole log, is told from the clock by its spectrum:
    the clock's is even, of `density` [s^2], a move's falls with frequency."""
    late, below = told[0], np.full(len(t), bands[0])
    to_end, still = np.minimum(t - t[0], t[-1] - t), np.ones(len(t), bool)
    for k, band in enumerate(bands[1:], 1):
        width = max(3, round(2.0 / (band * step)))
        power = running((told[k] - told[k - 1]) ** 2, width, "mean")
        clock = density * (_kept(band * step) - _kept(bands[k - 1] * step))
        still &= (running(power > _MOTION * clock, width, "max") == 0.0) & (to_end >= 1.0 / band)
        late, below = np.where(still, told[k], late), np.where(still, band, below)
    return late, below


def _late(t, q, late, even, band: float) -> np.ndarray:
    """How late [s] samples were, of a motion that stays below a frequency, and the share of an
    error's power that is left of it (2, n).

    Args:
        late: (n,) as far as it is known. even: `_evenly` of the samples with that.
    """
    beside, speed = _beside(t + late, q, even, band)
    beside = beside + speed * late[:, None]
    noise, off = _components(beside, speed)
    if not off > 0.0:
        return np.zeros((2, len(t)))
    # less than this of what the clock makes of fast motion is not to be told from corners of slow
    weight = 1.0 / np.maximum(noise, _LEAST * off * np.max(speed**2, axis=0))
    told = speed**2 @ weight + 1.0 / off
    found = (beside * speed) @ weight / told
    # what is slower, an earlier round and another frequency brought in
    found = found - low(found, band, even[0][1] - even[0][0])
    doubt = (1.0 / off + speed**2 @ (weight**2 * noise)) / (off * told**2)
    return np.stack([np.clip(found, -_MOST * np.sqrt(off), _MOST * np.sqrt(off)), doubt])


def _bands(t, q, step: float) -> tuple[list[float], float]:
    """Frequencies [Hz], falling, above which a log holds no motion: what the clock makes of the
    angles is as dense above each as above the highest, and all else is less by far. And the
    variance [s^2] of the clock's errors at all frequencies."""
    frequency, first, found = _HIGHEST / step, None, []
    most, even = _LITTLE + _SCATTER / len(t), _evenly(t, q)
    while frequency > _LOWEST:
        beside, speed = _beside(t, q, even, frequency)
        noise, off = _components(beside, speed)
        density = off / _kept(frequency * step)
        # what all joints together leave of the clock's power in doubt
        left = 1.0 / max(float(np.sum(off * np.mean(speed**2, axis=0) / (noise + 1e-300))), 1e-300)
        first = first or (density, left)
        if not 0.0 < density <= _WHITE * first[0] or left > max(most, 2.0 * first[1]):
            break
        found.append(frequency)
        frequency *= _FINER
    return found, 0.0 if first is None else first[0]


def _kept(frequency: float) -> float:
    """The share of white noise's power that stands above a frequency [cycles a sample]."""
    pulse = np.zeros(1025)
    pulse[512] = 1.0
    return float(np.sum((pulse - low(pulse, frequency, 1.0)) ** 2))


def _evenly(t, q) -> tuple[np.ndarray, np.ndarray]:
    """As many evenly spaced times (n,), and the angles (n, dof) there."""
    from scipy.interpolate import make_interp_spline

    clock = np.linspace(t[0], t[-1], max(len(t), 2))
    return clock, make_interp_spline(t, q, k=3, axis=0)(clock)


def _beside(t, q, even, frequency: float) -> tuple[np.ndarray, np.ndarray]:
    """By how much angles (n, dof) at times t (n,) stand beside their motion below a frequency, and
    its speed.

    Args:
        even: `_evenly` of them.
    """
    from scipy.interpolate import make_interp_spline

    clock, angles = even
    below = low(angles, frequency, clock[1] - clock[0])
    smooth = make_interp_spline(clock, below, k=3, axis=0)
    return q - smooth(t), smooth(t, 1)


def _components(beside, speed) -> tuple[np.ndarray, float]:
    """The variances of the angles' own noise (dof,) and of the clock [s^2]: medians of squares in
    bins of speed, as a knock or a corner of the motion is in few samples."""
    from scipy.optimize import nnls

    dof = beside.shape[1]
    rows, squares = [], []
    for j in range(dof):
        for bin_ in np.array_split(np.argsort(speed[:, j] ** 2), _BINS):
            rows.append(np.zeros(dof + 1))
            rows[-1][j], rows[-1][dof] = 1.0, np.mean(speed[bin_, j] ** 2)
            squares.append(np.median(beside[bin_, j] ** 2) / _MEDIAN)
    rows, squares = np.array(rows), np.array(squares)
    # near a standstill the ringing of the low-pass is more than the rest: bins say by how much they
    # are off as a share of what they hold, and of no less than a share of the joint's largest
    least = np.repeat(_LEAST * squares.reshape(dof, -1).max(axis=1), _BINS) + 1e-300
    found, told = np.zeros(dof + 1), np.maximum(squares, least)
    for _ in range(6):
        scaled = rows / told[:, None]
        size = np.sqrt(np.mean(scaled**2, axis=0)) + 1e-300
        found = nnls(scaled / size, squares / told)[0] / size
        told = np.maximum(rows @ found, least)
    return found[:dof], float(found[dof])
