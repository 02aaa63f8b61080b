"""Stamps of when samples arrived, of samples that were taken evenly: late now and then, some of them in
one packet, and none of them missing. Angles tell it: on an even clock they are smooth.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from .errors import LogError
from .recording import Recording
from .rounded_stamps import ROUNDED, off_steady
from .running import running
from .segment import gaps
from .warned import warn

_PIECE, _ORDER = 21, 3  # samples in which a motion is a polynomial of that order
_SMOOTHER = 0.25  # of the squares beside it, on an even clock: half as far from a smooth motion
_FEWEST = 20  # such stretches
_NEVER_LATE = 64  # samples of which one at least arrived at once
_STEADY = 1.0  # steps: the earliest stamps stay on one line, or samples are missing
_IRREGULAR = 0.05  # of a step, RMS: what is less, resampling mends


def evened(samples: Recording) -> Recording:
    """Samples with an even clock where their angles say that they were taken so, which is told."""
    t, late = samples.t.astype(float, copy=True), 0.0
    bounds = np.union1d(samples.breaks, _lost(samples.t)).astype(int)
    for first, last in pairwise([0, *bounds.tolist(), len(t)]):
        own = slice(first, last)
        if (even := _even(t[own], samples.signals["q"][own])) is not None:
            late = max(late, float(np.max(t[own] - even)))
            t[own] = even
        elif wrong := [row for row in samples.together if first <= row < last]:
            raise LogError(
                f"time stands still: two samples at {t[wrong[0]]:.9g} s",
                where=f"{samples.where} row {wrong[0]} counted from 0",
                allowed="increasing time",
                do="leave doubles out",
            )
    if not late:
        return samples
    warn(
        f"{samples.where}: the time stamps are late by up to {1e3 * late:.2g} ms, and the joints' angles "
        "say that samples were taken evenly: they are read so",
        above=2,
    )
    return replace(samples, t=t)


def _lost(t: np.ndarray) -> np.ndarray:
    """Rows before which samples of a clock (n,) are missing: after a stall those that were late come
    at once, and the clock is where it would have been."""
    rows = gaps(t)
    step = (t[-1] - t[0]) / max(len(t) - 1, 1)
    gap = t[rows] - t[rows - 1]
    caught = np.minimum(rows + np.round(2.0 * gap / step).astype(int), len(t) - 1)
    return rows[t[caught] - t[rows - 1] > (caught - rows + 1) * step + 0.5 * gap]


def _even(t: np.ndarray, q: np.ndarray) -> np.ndarray | None:
    """An even clock (n,) for samples of angles q (n, dof) with stamps t (n,), none where they tell of none."""
    n, steps = len(t), np.diff(t)
    if n < _FEWEST * _PIECE or not np.std(steps) > _IRREGULAR * np.median(steps):
        return None
    if off_steady(t, float(np.median(steps))) <= ROUNDED:
        return None  # rounded, and not late
    index = np.arange(n)
    earliest = _earliest(t, index)
    if earliest is None:
        return None
    slope, start = earliest
    even = start + slope * index
    with np.errstate(divide="ignore", invalid="ignore"):
        smoother = _beside(even, q) / _beside(t, q)
    moving = np.isfinite(smoother)
    return even if moving.any() and np.median(smoother[moving]) < _SMOOTHER else None


def _earliest(t, index) -> tuple[float, float] | None:
    """Slope and start of the line of the stamps that are not late; None where there is no such line."""
    slope = (t[-1] - t[0]) / (len(t) - 1)
    for _ in range(3):
        early = running(-(t - slope * index), _NEVER_LATE, "max", "edge")  # the larger, the earlier
        more, start = np.polyfit(index, -early, 1)
        slope += more
    left = -early - (start + more * index)
    return (slope, start) if np.ptp(left) < _STEADY * slope else None


def _beside(t, q) -> np.ndarray:
    """(dof,) what no polynomial has of angles q (n, dof) at times t (n,), in stretches by themselves: sums of squares."""
    count = len(t) // _PIECE
    at = t[: count * _PIECE].reshape(count, _PIECE)
    at = at - at.mean(axis=1, keepdims=True)
    at = at / np.maximum(np.abs(at).max(axis=1, keepdims=True), 1e-300)
    powers = at[:, :, None] ** np.arange(_ORDER + 1)
    basis, _ = np.linalg.qr(powers)
    values = q[: count * _PIECE].reshape(count, _PIECE, -1)
    left = values - basis @ (np.swapaxes(basis, 1, 2) @ values)
    return np.sum(left**2, axis=(0, 1))
