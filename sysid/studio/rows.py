"""Rows of logs that two models predict, laid over each other."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..prediction import Prediction

# of a joint: measured, predicted, residual, (n,) each, as `Prediction.of_joint` has them
Columns = tuple[np.ndarray, np.ndarray, np.ndarray]


class Shown(Protocol):
    """What can be laid over a fit."""

    def prediction(self, part: str) -> Prediction:
        """Of a part of the logs."""

    def told(self, part: str) -> list[float | None]:
        """The RMS of each joint on it."""

    def times(self, part: str) -> np.ndarray:
        """(n,) of its rows [s], by the clocks of their logs."""

    def columns(self, part: str, joint: int) -> Columns:
        """What it says of a joint."""


def same_rows(other: Shown, seen: Shown, part: str, joint: int):
    """Predicted torque and residual (n,) of another model on the rows in sight, NaN where it has
    none of them; None where its logs are others."""
    theirs, mine = other.times(part), seen.times(part)
    if np.array_equal(mine, theirs):
        return other.columns(part, joint)[1:]
    torque, residual = (np.full(len(mine), np.nan) for _ in range(2))
    known = other.columns(part, joint)[1:]
    logs, shown = other.prediction(part).log, seen.prediction(part).log
    for log in np.flatnonzero(np.bincount(shown)):
        rows, own = _span(shown == log), _span(logs == log)
        if not len(theirs[own]):
            continue
        here, there = _meeting(mine[rows], theirs[own])
        for out, values in zip((torque, residual), known):
            out[rows][here] = values[own][there]
    return (torque, residual) if np.isfinite(torque).mean() > 0.5 else None


def _span(some) -> slice:
    """The rows of one log, which stand together."""
    found = np.flatnonzero(some)
    return slice(int(found[0]), int(found[-1]) + 1) if len(found) else slice(0, 0)


def _meeting(mine, theirs):
    """Places in two rising sequences that hold the same; mostly, as another filter has other edges,
    a stretch of each."""
    first = max(mine[0], theirs[0])
    a, b = int(np.searchsorted(mine, first)), int(np.searchsorted(theirs, first))
    n = min(len(mine) - a, len(theirs) - b)
    if np.array_equal(mine[a : a + n], theirs[b : b + n]):
        return slice(a, a + n), slice(b, b + n)
    at = np.minimum(np.searchsorted(theirs, mine), len(theirs) - 1)
    same = theirs[at] == mine
    return same, at[same]


def rms(values) -> float | None:
    """Root mean square of the numbers among values; None where there is none."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else None
