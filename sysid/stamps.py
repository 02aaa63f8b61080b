"""The clock that a log has: where it starts anew, which samples came together, and that it increases."""

from __future__ import annotations

import numpy as np

from .errors import LogError
from .outliers import SHORT
from .segment import GAP_STEPS

_LITTLE = 1e-3  # of a step


def starts(t, breaks) -> np.ndarray:
    """Rows at which a clock (n,) runs back, not at a break that is known, and on from there, as of
    another recording; not where it is by as little, or for as short, as of rows in a wrong order.
    """
    steps = np.diff(t)
    back = np.setdiff1d(np.flatnonzero(steps < 0.0) + 1, breaks)
    if not len(back):
        return back
    on = steps[steps > 0.0]
    usual = GAP_STEPS * max(np.median(on), np.mean(np.minimum(on, GAP_STEPS * np.median(on))))
    size = -steps[back - 1]
    leap = np.array([steps[row : row + SHORT].max(initial=0.0) for row in back])
    # a stamp that is wrong leaps on again by as much
    if np.any(size <= usual) or np.any(leap > 0.5 * size):
        return back[:0]
    return back if np.all(long_enough(back, breaks, len(t))) else back[:0]


def long_enough(rows, breaks, n: int) -> np.ndarray:
    """Which of some rows (k,) of n, at which another recording may begin, stand between two pieces
    that are long enough to be recordings; `breaks` begin others."""
    bounds = np.union1d(np.concatenate([[0], rows, [n]]), breaks).astype(int)
    at = np.searchsorted(bounds, rows)
    return np.minimum(bounds[at] - bounds[at - 1], bounds[at + 1] - bounds[at]) >= SHORT


def in_packets(t, signals, breaks) -> tuple[np.ndarray, tuple[int, ...]]:
    """The clock with what has the stamp of the row before it and other values a little behind it, as
    of samples that arrived in one packet, and these rows.

    Args:
        breaks: rows at which another recording begins.
    """
    steps = np.diff(t)
    steps[np.asarray(breaks, dtype=int) - 1] = 0
    other = np.any([_differ(np.diff(signals[name], axis=0)) for name in ("q", "tau")], axis=0)
    together = (steps == 0) & other
    together[np.asarray(breaks, dtype=int) - 1] = False
    rows = np.flatnonzero(together) + 1
    if not len(rows) or np.any(steps < 0):
        return t, ()
    t = t.astype(float, copy=True)
    # of a packet the first has its stamp, and each of the others stands a little behind the one before
    number = np.arange(len(t))
    behind = number - np.maximum.accumulate(np.where(np.append(False, together), 0, number))
    later = steps[steps > 0]
    little = min(_LITTLE, 0.5 / behind.max()) * float(later.min()) if len(later) else 0.0
    return t + little * behind, tuple(rows.tolist())


def increasing(t, breaks, where: str) -> np.ndarray:
    """The clock with every recording put a step behind the one before, where it does not stand
    behind it anyway."""
    if not np.isfinite(t).all():
        raise LogError(
            "time is not a finite number",
            where=f"{where} row {int(np.argmin(np.isfinite(t)))} counted from 0",
            do="leave the row out",
        )
    if len(t) < 2:
        raise LogError(
            "the log has one sample", where=where, allowed="two or more", do="give a longer log"
        )
    steps = np.diff(t)
    within = np.ones(len(steps), dtype=bool)
    within[breaks - 1] = False
    if (backwards := within & (steps <= 0.0)).any():
        row = int(np.argmax(backwards)) + 1
        verb = "stands still" if t[row] == t[row - 1] else "runs backwards"
        raise LogError(
            f"time {verb}: {t[row - 1]:.9g} s, then {t[row]:.9g} s",
            where=f"{where} row {row} counted from 0",
            allowed="increasing time",
            do="leave doubles out, and sort rows that stand in a wrong order",
        )
    anew = [row for row in breaks if steps[row - 1] <= 0.0]
    if anew:
        step = float(np.median(steps[within])) if within.any() else 1.0
        t = t.astype(float, copy=True)
        for row in anew:
            t[row:] += t[row - 1] + step - t[row]
    return t


def _differ(steps) -> np.ndarray:
    return np.any(steps != 0.0, axis=1)
