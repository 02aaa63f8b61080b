"""Noise as the scatter between repeats of the motion, whatever its colour and whatever the model lacks.

Second differences over three repeats (first over two) leave out what drifts in step with time. Shifts are by whole
samples, so that nothing is done to the noise.
"""

import math

import numpy as np

from .stretches import Run, moving

# rms difference of each joint's positions, share of its range; and how far away it must have been in between
_TOLERANCE, _AWAY = 0.003, 0.05
_BLOCKS = 30
_INDEPENDENT = 1.94  # second differences of repeats per independent one
_TINY = 1e-300


def scatter(signals, kept, periods) -> tuple[float, float] | None:
    """RMS of the noise and its standard error, None where nothing repeats.

    Args:
        signals: several versions of the torque, (n,) of each run [N m or N]; each scatters by the noise or more.
        kept: (n,) bool of each run, rows that count.
        periods: [samples] of each run, or None.
    """
    found = []
    for values_of in signals:
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
        squares = np.concatenate(squares) if squares else np.zeros(0)
        if len(squares) < _BLOCKS:
            return None
        found.append(block_rms(squares))
    return min(found)


def block_rms(squares: np.ndarray) -> tuple[float, float]:
    """RMS and its standard error, from blocks of time."""
    blocks = np.array([b.mean() for b in np.array_split(squares, min(_BLOCKS, len(squares)))])
    rms = math.sqrt(squares.mean())
    error = float(blocks.std(ddof=1)) * math.sqrt(_INDEPENDENT / len(blocks))
    return rms, error / (2.0 * rms + _TINY)


def period_of(run: Run) -> float | None:
    """The samples, seldom whole, after which all joints come back, and have time to do so twice; None where they do not."""
    q, n = run.q, len(run.q)
    moves = moving(q)
    if not moves.any():
        return None
    x = (q[:, moves] - q[:, moves].mean(0)) / np.ptp(q[:, moves], axis=0)
    lag = np.arange(n // 2 + 1)
    spectrum = np.fft.rfft(x, 1 << (2 * n - 1).bit_length(), axis=0)
    products = np.fft.irfft(np.abs(spectrum) ** 2, axis=0)[lag]
    before = np.concatenate([np.zeros((1, x.shape[1])), np.cumsum(x**2, axis=0)])
    # mean squares, each joint's
    distance = (before[n - lag] + before[n] - before[lag] - 2.0 * products) / (n - lag)[:, None]
    worst = distance.max(axis=1)
    away = np.flatnonzero(worst > _AWAY**2)
    if not len(away):
        return None
    # in one sample: a period that ends between two is missed by some of it
    moves = np.mean(np.diff(x, axis=0) ** 2, axis=0)
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
