"""Rows of a residual that no noise makes: spikes, bursts, and what friction's jump leaves about
reversals.

Noise of any colour differs from one moment to the next as a Gaussian does, on every time scale. So
means of L samples before and after each row are subtracted, for L from one sample to a share of the
motion's quickest period; where the difference is an outlier among all of them, the rows are left
out.
"""

import math
from collections.abc import Sequence

import numpy as np

from ..nonnegative import least_squares
from ..outliers import NORMAL
from ..running import running
from .stretches import Run, bridged, moving

_OUTLYING = 5.0  # robust standard deviations: a Gaussian does that once in two million
_DIGITS = 2.0  # digits of a coarse torque that it may jump by and be quiet
_SHARE = 0.25  # of the quickest period of the motion: beyond it misfit is no burst
_MOST = 0.25  # of the rows; where more stand out, they are no exception
# Reversals: share of its rms speed below which a joint is slow, of the time it may be, and the
# ratio of mean squares, slow over fast, that noise does not have.
_SLOW, _MOST_SLOW, _LARGER = 0.12, 0.25, 2.0
_ALIKE = 10  # groups of values by the size of the noise about them
_KNOWN = 4.0  # the most that its square is larger than drawn


def without(
    values: list[np.ndarray], kept: list[np.ndarray], steps: list[float], bandwidth: float,
    digit: float = 0.0, drawn: list[np.ndarray] | None = None,
    speeds: list[np.ndarray] | None = None,
) -> tuple[list[np.ndarray], list[np.ndarray]]:  # fmt: skip
    """Which rows (n,) of each run are kept, and the values with what is left out bridged.

    `digit` is the least difference of logged torques [N m or N]: that much is no outlier. `drawn`
    (draws, n) is what the angles' noise makes of each run: where there is more, more is usual.
    `speeds` (n,) are the joint's: as a drive's ripple does, noise may grow with them.
    """
    shortest = min(steps)
    longest = max(1, int(_SHARE / (bandwidth * shortest))) if bandwidth > 0.0 else 1
    kept, values, all_rows = list(kept), list(values), sum(int(k.sum()) for k in kept)
    louder = None
    for level in range(int(math.log2(longest)) + 1):
        width = 2**level
        steps_of = [_step(v, k, width) for v, k in zip(values, kept)]
        sizes = [np.abs(d[~np.isnan(d)]) for d in steps_of]
        sizes = np.concatenate(sizes) if sizes else np.zeros(0)
        if not len(sizes) or not (typical := float(np.median(sizes)) / NORMAL) > 0.0:
            continue
        usual = [np.full(len(d), typical) for d in steps_of]
        if drawn is not None:
            spans = [0.5 / (bandwidth * step) for step in steps]
            local = [
                _local([_step(v, k, width) for v in once], n)
                for once, k, n in zip(drawn, kept, spans)
            ]
            # so few independent values tell it: two standard errors of theirs are usual
            number = [max(n / (2 * width + 1), len(v)) for v, n in zip(drawn, spans)]
            unsure = [1.0 + 2.0 / math.sqrt(2.0 * n) for n in number]
            usual = _by_local(steps_of, local, typical, unsure)
        if width == 1 and speeds is not None:
            louder = _louder([np.abs(d) / typical for d in steps_of], speeds)
        if louder is not None:
            more = [typical * own[width : width + len(d)] for own, d in zip(louder, steps_of)]
            usual = [np.maximum(*own) for own in zip(usual, more)]
        found = []
        for d, k, scale in zip(steps_of, kept, usual):
            most = np.maximum(_OUTLYING * scale, _DIGITS * digit)
            hit = np.flatnonzero(np.nan_to_num(np.abs(d)) > most)
            turns = np.zeros(len(k) + 1, dtype=np.int64)  # both means are suspect
            turns[hit] += 1
            turns[hit + 2 * width] -= 1
            out = np.cumsum(turns[:-1]) > 0
            found.append(k & ~out)
        if sum(int(k.sum()) for k in found) < (1.0 - _MOST) * all_rows:
            continue
        values = [bridged(v, f) if f.sum() > 2 else v for v, f in zip(values, found)]
        kept = [f if f.sum() > 2 else k for f, k in zip(found, kept)]
    return kept, values


def _louder(sizes: list[np.ndarray], speeds: list[np.ndarray]) -> list[np.ndarray]:
    """How many times louder than usual noise is at each row (n,) of runs, one at least, where it
    grows with the size of a speed (n,).

    By medians of `sizes` (n - 1,) over what is usual, of differences from one sample to the next,
    among rows of about the same speed: no misfit is so fast, and no burst is in most such rows.
    """
    size = np.concatenate(sizes)
    speed = np.concatenate([np.abs(v)[: len(d)] for v, d in zip(speeds, sizes)])
    there = np.flatnonzero(np.isfinite(size))
    if (bins := min(_ALIKE, len(there) // _ALIKE**2)) < 2:
        return [np.ones(len(v)) for v in speeds]
    by_speed = np.array_split(there[np.argsort(speed[there])], bins)
    at, times = (np.array([np.median(x[own]) for own in by_speed]) for x in (speed, size))
    grows = np.maximum(np.maximum.accumulate(times / NORMAL), 1.0)
    return [np.interp(np.abs(v), at, grows) for v in speeds]


def of_drawn(values, kept, drawn, steps, bandwidth: float) -> float:
    """How many times the power of `drawn` (draws, n) is in values (n,) of runs where they are
    `kept` (n,): from medians, so that neither misfit nor a few rows say it."""
    own = [np.where(k, v, np.nan) for v, k in zip(values, kept)]
    local = [_local(v, 0.5 / (bandwidth * step)) for v, step in zip(drawn, steps)]
    return _white_and_more(own, local, 1.0)[1]


def usual(values, drawn, steps, bandwidth: float):
    """The size (n,) of each run's noise where `drawn` (draws, n) says that it differs from row to
    row; None where nothing is drawn."""
    if drawn is None:
        return None
    typical = float(np.median(np.abs(np.concatenate(values)))) / NORMAL
    local = [_local(v, 0.5 / (bandwidth * step)) for v, step in zip(drawn, steps)]
    found = _by_local(values, local, typical, [1.0] * len(local)) if typical > 0.0 else None
    return found if found is not None and all((v > 0.0).all() for v in found) else None


def _local(draws: Sequence[np.ndarray], samples: float) -> np.ndarray:
    """RMS (n,) of values (n,) of draws, so many samples about each in all, nan counting for
    nothing."""
    size = max(3, 2 * round(0.5 * samples / len(draws)) + 1)
    square = running(np.mean(np.nan_to_num(draws) ** 2, axis=0), size, "mean", "edge")
    return np.sqrt(np.maximum(square, 0.0))


def _by_local(
    values: list[np.ndarray], local: list[np.ndarray], typical: float, unsure: list[float]
) -> list[np.ndarray]:
    """The usual size (n,) of values that are white noise plus some multiple of noise whose size is
    `local` (n,) of each run. `unsure`: by how much that of each run may be too small."""
    white, more = _white_and_more(values, local, typical)
    return [np.sqrt(white * typical**2 + more * (u * own) ** 2) for own, u in zip(local, unsure)]


def _white_and_more(
    values: list[np.ndarray], local: list[np.ndarray], typical: float
) -> tuple[float, float]:
    """Multiples of `typical`^2 and of the square of `local` (n,) that values (n,), nan left aside,
    are the sum of: from medians among values about which it is alike."""
    every, size = np.concatenate(values), np.concatenate(local)
    there = ~np.isnan(every)
    every, size = np.abs(every[there]), size[there]
    if len(every) < _ALIKE**2 or not size.any():
        return 1.0, 0.0
    ends = len(size) * np.arange(1, _ALIKE) // _ALIKE
    bins = np.split(np.argpartition(size, ends), ends)
    usual = np.array([np.median(every[own]) / NORMAL for own in bins]) ** 2
    # the middle one here as well: at the ends of a log a few may be ten times as large
    square = np.array([np.median(size[own]) for own in bins]) ** 2
    shape = np.stack([np.full(_ALIKE, typical**2), square], axis=1)
    weight = 1.0 / np.maximum(usual, 1e-6 * usual.max())  # each median is as sure as it is large
    white, more = least_squares(shape * weight[:, None], usual * weight)
    return white, min(more, _KNOWN)


def _step(values: np.ndarray, counts: np.ndarray, width: int) -> np.ndarray:
    """Mean of `width` samples less that of the `width` before them (n - 2 width + 1,), nan where a
    gap takes much of it."""
    if len(values) < 2 * width + 1:
        return np.full(0, np.nan)
    total = np.concatenate([[0.0], np.cumsum(values)])
    sums = total[width:] - total[:-width]
    out = (sums[width:] - sums[:-width]) / width
    if not counts.all():
        number = np.concatenate([[0], np.cumsum(counts)])
        whole = number[2 * width :] - number[: -2 * width]
        out[whole < 1.5 * width] = np.nan
    return out


def away_from_reversals(
    runs: list[Run], v: np.ndarray, values: list[np.ndarray], kept: list[np.ndarray]
) -> list[np.ndarray]:
    """Which rows (n,) of each run are kept where those about any joint's reversals, `v` (n, dof)
    its speed, are left out if the residual is much larger there. Sticking lasts a hundredth of the
    time and can hold most of the misfit."""
    square, counts = np.concatenate(values) ** 2, np.concatenate(kept)
    slowness = np.abs(v) / np.sqrt(np.mean(v**2, axis=0) + 1e-300)
    left = counts.copy()
    for k in np.flatnonzero(moving(np.concatenate([run.q for run in runs]))):
        slow, fast = counts & (slowness[:, k] < _SLOW), counts & (slowness[:, k] >= _SLOW)
        if not 0 < slow.sum() < _MOST_SLOW * counts.sum():
            continue
        fewer = left & fast
        if square[slow].mean() > _LARGER * square[fast].mean() and fewer.sum() > 0.6 * counts.sum():
            left = fewer
    ends = np.cumsum([len(k) for k in kept])[:-1]
    return [a if a.sum() > 2 else b for a, b in zip(np.split(left, ends), kept)]


def digit_of(torque: np.ndarray) -> float:
    """The least difference [N m or N] of two torques (n,) as logged, rounding aside."""
    apart = np.diff(np.unique(torque))
    apart = apart[apart > 1e-9 * np.abs(torque).max(initial=0.0)]
    return float(apart.min(initial=np.inf)) if len(apart) else 0.0
