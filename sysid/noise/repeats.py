"""Noise as the scatter between repeats of the motion, whatever its colour and whatever the model
lacks.

Second differences over three repeats (first over two) leave out what drifts in step with time.
Shifts are by whole samples, so that nothing is done to the noise.
"""

import math

import numpy as np

from ..blocks import averaged
from .stretches import moving

# rms difference of each joint's positions, share of its range; and how far away it must have been
# in between
_TOLERANCE, _AWAY = 0.003, 0.05
_BLOCKS = 30
_INDEPENDENT = 1.94  # second differences of repeats per independent one
MADE = 0.2  # of the power that the angles' noise makes: as its RMS is known to a tenth
_TINY = 1e-300


def scatter(signals, torque, kept, periods, angles: float = 0.0) -> tuple[float, float] | None:
    """RMS of the noise and its standard error, None where nothing repeats.

    Of the noise of the angles, what the motion repeats too is not seen between repeats (the grain
    of an encoder that a periodic motion meets at the same places), and torque as measured shows
    none of it: what is not seen is added.

    Args:
        signals: versions of the residual, (n,) of each stretch [N m or N]; the last is as the model
            leaves it. Each scatters by the noise or more.
        torque: as measured, the same.
        kept: (n,) bool of each stretch, rows that count.
        periods: [samples] of each stretch, or None.
        angles: mean square of what the noise of the angles adds to the torque that is predicted.
    """
    predicted = [told - left for told, left in zip(torque, signals[-1])]
    parts = (torque, predicted, *signals)
    measured, moved, *left = (_squares(values, kept, periods) for values in parts)
    if len(measured) < _BLOCKS:
        return None
    # that the motion is not quite the same stands in what is predicted, and not in the residual
    unseen = angles - min(float(np.mean(moved)), float(np.mean(left[-1])), angles)
    return min(_with(measured, angles), *(_with(own, unseen) for own in left))


def _with(squares: np.ndarray, unseen: float) -> tuple[float, float]:
    """RMS and its standard error, with a mean square of the angles' noise that is not seen."""
    rms, error = block_rms(squares)
    whole = math.sqrt(rms**2 + unseen)
    return whole, math.hypot(error * rms, 0.5 * MADE * unseen) / (whole + _TINY)


def mean_square(drawn, kept) -> float:
    """Of what is drawn (draws, n) of each run, over the rows (n,) that are kept; 0 of nothing."""
    if drawn is None:
        return 0.0
    every = np.concatenate([values[:, rows].ravel() for values, rows in zip(drawn, kept)])
    return float(every @ every) / max(len(every), 1)


def _squares(values_of, kept, periods) -> np.ndarray:
    """The squares of what differs between repeats, as those of the noise."""
    squares = []
    for values, counts, period in zip(values_of, kept, periods):
        if period is None:
            continue
        n, one, two = len(values), round(period), round(2 * period)
        if n >= 3 * period:
            a, b, c = (slice(k, k + n - two) for k in (0, one, two))
            square = (values[a] - 2.0 * values[b] + values[c]) ** 2 / 6.0
            both = counts[a] & counts[b] & counts[c]
        else:
            square = (values[one:] - values[:-one]) ** 2 / 2.0
            both = counts[one:] & counts[:-one]
        squares.append(square[both])
    return np.concatenate(squares) if squares else np.zeros(0)


def block_rms(squares: np.ndarray) -> tuple[float, float]:
    """RMS and its standard error, from blocks of time."""
    mean, error = averaged(squares, min(_BLOCKS, len(squares)))
    rms, error = math.sqrt(mean), error * math.sqrt(_INDEPENDENT)
    return rms, error / (2.0 * rms + _TINY)


def period_of(q: np.ndarray, counts: np.ndarray) -> float | None:
    """The samples, seldom whole, after which all joints come back, and have time to do so twice;
    None where they do not.

    Args:
        q: (n, dof) positions [rad or m].
        counts: (n,) bool, rows that count.
    """
    if counts.sum() < _BLOCKS or not (moves := moving(q[counts])).any():
        return None
    rows = np.flatnonzero(counts)
    q, counts = q[rows[0] : rows[-1] + 1], counts[rows[0] : rows[-1] + 1]
    n = len(q)
    inside = q[counts][:, moves]
    x = np.where(counts[:, None], (q[:, moves] - inside.mean(0)) / np.ptp(inside, axis=0), 0.0)
    lag = np.arange(n // 2 + 1)
    distance = _distance(x, counts, lag)
    worst = distance.max(axis=1)
    away = np.flatnonzero(worst > _AWAY**2)
    if not len(away):
        return None
    # in one sample: a period that ends between two is missed by some of it
    moves = np.mean(np.diff(x, axis=0)[counts[1:] & counts[:-1]] ** 2, axis=0)
    near = (distance < _TOLERANCE**2 + 0.25 * moves).all(axis=1)
    last = 0
    for first in np.flatnonzero(near & (lag > away[0])):
        if first <= last:
            continue
        last = int(first)
        while last + 1 < len(lag) and worst[last + 1] < worst[last]:
            last += 1
        if last + 1 == len(lag):
            break
        below, here, above = distance[last - 1 : last + 2].sum(axis=1)
        offset = 0.5 * (below - above) / max(below - 2.0 * here + above, _TINY)
        if abs(offset) <= 1.0 and (distance[last] - moves * offset**2 < _TOLERANCE**2).all():
            return last + offset
    return None


def _distance(x: np.ndarray, counts: np.ndarray, lag: np.ndarray) -> np.ndarray:
    """Mean square (lags, joints) of x (n, joints), zero where it does not count, less itself later;
    infinite where fewer than a third of the rows meet rows that count."""
    n, size = len(x), 1 << (2 * len(x) - 1).bit_length()
    spectrum = np.fft.rfft(x, size, axis=0)
    products = np.fft.irfft(np.abs(spectrum) ** 2, axis=0)[lag]
    if counts.all():
        before = np.concatenate([np.zeros((1, x.shape[1])), np.cumsum(x**2, axis=0)])
        return (before[n - lag] + before[n] - before[lag] - 2.0 * products) / (n - lag)[:, None]
    mask, square = np.fft.rfft(counts.astype(float), size), np.fft.rfft(x**2, size, axis=0)
    meet = np.fft.irfft(np.abs(mask) ** 2)[lag]
    both = np.fft.irfft(2.0 * (square * mask.conj()[:, None]).real, axis=0)[lag]
    enough = meet > (n - lag) / 3.0
    mean = (both - 2.0 * products) / np.maximum(meet, 1.0)[:, None]
    return np.where(enough[:, None], mean, np.inf)
