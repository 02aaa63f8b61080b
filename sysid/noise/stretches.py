"""The rows of a log that count, as contiguous runs, and the bandwidth of their motion.

A gap shorter than a twentieth of the motion's period is bridged, as the motion hardly bends
meanwhile; any other one parts two runs. What stands in a gap is never looked at.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..frequencies import low
from ..lowpass import KEPT

_MOST_SAMPLES = 120_000  # looked at over all runs
FEWEST_SAMPLES = 40  # of a run worth looking at
_BRIDGED = 0.05  # of the period of the quickest joint
_BANDWIDTH_SHARE = 0.995  # of the power of every joint's velocity
_TINY = 1e-300


@dataclass(frozen=True)
class Run:
    """Contiguous samples that count for a joint, but for bridged gaps.

    stretch, rows: where they stand. counts (n,) bool: False in a bridged gap. q (n, dof) [rad or
        m], bridged by straight lines. step [s]. time (n,): from 0 to 1 over the stretch.
    """

    stretch: int
    rows: slice
    counts: np.ndarray
    q: np.ndarray
    step: float
    time: np.ndarray

    def of(self, values: np.ndarray) -> np.ndarray:
        """The run's part (n,) of a column (rows of the stretch,), its gaps bridged."""
        return bridged(values[self.rows], self.counts)


def runs_of(
    q: Sequence[np.ndarray], step: Sequence[float], use: Sequence[np.ndarray] | None
) -> list[Run]:
    """The longest runs, longest first, at most 120 000 samples in all.

    Args:
        q: (n, dof) positions [rad or m] of each stretch.
        step: [s] of each stretch.
        use: (n,) bool of each stretch, or None for every row.
    """
    use = [np.ones(len(x), dtype=bool) for x in q] if use is None else use
    quickest = _quickness(q, step, use)
    runs = []
    for k, (x, h, counts) in enumerate(zip(q, step, use)):
        longest_gap = _BRIDGED / (quickest * h) if quickest > 0.0 else math.inf
        for first, last in _bounds(counts, longest_gap):
            if last - first >= FEWEST_SAMPLES:
                rows = slice(first, last)
                time = np.arange(first, last) / len(x)
                filled = np.stack([_straight(c, counts[rows]) for c in x[rows].T], axis=1)
                runs.append(Run(k, rows, counts[rows], filled, float(h), time))
    kept, left = [], _MOST_SAMPLES
    for run in sorted(runs, key=lambda r: -len(r.q)):
        n = min(len(run.q), left)
        if n < FEWEST_SAMPLES:
            break
        if n < len(run.q):
            rows = slice(run.rows.start, run.rows.start + n)
            run = Run(run.stretch, rows, run.counts[:n], run.q[:n], run.step, run.time[:n])
        kept.append(run)
        left -= n
    return kept


def _quickness(q, step, use) -> float:
    """Hz: the rms speed of the quickest joint over its rms excursion, as a sine has them."""
    pairs = [u[1:] & u[:-1] for u in use]
    together = sum(int(p.sum()) for p in pairs)
    if not together:
        return 0.0
    square = sum(((np.diff(x, axis=0)[p] / h) ** 2).sum(0) for x, h, p in zip(q, step, pairs))
    all_q = np.concatenate([x[u] for x, u in zip(q, use)])
    spread = all_q.std(axis=0)
    moves = moving(all_q)
    if not moves.any():
        return 0.0
    return float(np.max(np.sqrt(square[moves] / together) / spread[moves]) / (2.0 * math.pi))


def _bounds(counts: np.ndarray, longest_gap: float) -> list[tuple[int, int]]:
    """First row and the row after the last of each run, gaps of at most so many samples bridged."""
    rows = np.flatnonzero(counts)
    if not len(rows):
        return []
    cut = np.flatnonzero(np.diff(rows) - 1 > longest_gap)
    return list(zip(rows[np.concatenate([[0], cut + 1])], rows[np.append(cut, -1)] + 1))


def moving(q: np.ndarray) -> np.ndarray:
    """Which joints (dof,) move."""
    span = np.ptp(q, axis=0)
    return (span > 1e-3 * span.max()) & (span > 0)


def _straight(values: np.ndarray, counts: np.ndarray) -> np.ndarray:
    if counts.all():
        return values
    at = np.arange(len(values))
    return np.where(counts, values, np.interp(at, at[counts], values[counts]))


def bridged(values: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Values (n,) with straight lines across gaps, between means of as many samples as the gap has
    on either side: the noise of single samples must not stretch over a gap."""
    if counts.all():
        return values
    kept = values[counts]
    before = np.concatenate([[0.0], np.cumsum(kept - kept.mean())])
    edges = np.flatnonzero(np.diff(np.concatenate([[True], counts, [True]]).astype(np.int8)))
    first, last = edges[::2], edges[1::2]  # gaps
    at = np.concatenate([[0], np.cumsum(counts)])[first]  # kept samples before each gap
    length = last - first
    mean = lambda low, high: (before[high] - before[low]) / np.maximum(high - low, 1)  # noqa: E731
    left = mean(np.maximum(at - length, 0), at)
    right = mean(at, np.minimum(at + length, len(kept)))
    left, right = np.where(at == 0, right, left), np.where(at == len(kept), left, right)
    out = values.copy()
    gap = np.repeat(np.arange(len(first)), length)
    rows = np.flatnonzero(~counts)
    share = (rows - first[gap] + 0.5) / length[gap]
    out[rows] = kept.mean() + left[gap] + (right - left)[gap] * share
    return out


def whole(runs: list[Run], values: list[np.ndarray], lengths: list[int]) -> list[np.ndarray]:
    """Values (n,) of runs in their stretches, zero or False elsewhere."""
    out = [np.zeros(n, dtype=values[0].dtype) for n in lengths]
    for run, x in zip(runs, values):
        out[run.stretch][run.rows] = x
    return out


def smoothed(run: Run, bandwidth: float) -> Run:
    """The run with its angles without what is faster than any motion of that bandwidth [Hz]: a
    function of the motion must not tell what the noise of the angles makes."""
    return replace(run, q=low(run.q, KEPT * bandwidth, run.step))


def bandwidth_of(runs: list[Run]) -> float:
    """Hz below which `_BANDWIDTH_SHARE` of every joint's velocity lies; 0 where none moves."""
    moves = moving(np.concatenate([run.q for run in runs]))
    if not moves.any():
        return 0.0
    longest = max(len(r.q) * r.step for r in runs)
    # a run much shorter than the longest cannot tell frequencies apart
    chosen = [r for r in runs if 2 * len(r.q) * r.step >= longest]
    frequency, power = [], []
    for run in chosen:
        velocity = np.diff(run.q[:, moves], axis=0)
        window = np.hanning(len(velocity) + 2)[1:-1, None]
        power.append(np.abs(np.fft.rfft(velocity * window, axis=0)) ** 2 / run.step**2)
        frequency.append(np.fft.rfftfreq(len(velocity), run.step))
    order = np.argsort(np.concatenate(frequency), kind="stable")
    total = np.cumsum(np.concatenate(power)[order], axis=0)
    within = np.argmax(total >= _BANDWIDTH_SHARE * total[-1], axis=0)
    return float(np.concatenate(frequency)[order][within.max()])


def lost(kept: np.ndarray, weight: np.ndarray, frequency: np.ndarray) -> np.ndarray | float:
    """Share of the noise power that bridging gaps loses, at frequencies [1/sample]: all of it
    within the gap where that is long against a period, none where it is short."""
    if kept.all():
        return 0.0
    edges = np.flatnonzero(np.diff(np.concatenate([[True], kept, [True]]).astype(np.int8)))
    length, total = edges[1::2] - edges[::2], np.concatenate([[0.0], np.cumsum(weight)])
    share = (total[edges[1::2]] - total[edges[::2]]) / total[-1]
    lengths, which = np.unique(length, return_inverse=True)
    grid = np.geomspace(frequency[0], frequency[-1], 60)
    lost = (1.0 - np.sinc(np.outer(grid, lengths)) ** 2) @ np.bincount(which, share)
    return np.minimum(np.interp(frequency, grid, lost), 0.9)
