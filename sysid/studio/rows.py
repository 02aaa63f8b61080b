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
    predicted, left = np.full(len(mine), np.nan), np.full(len(mine), np.nan)
    _, torque, residual = other.columns(part, joint)
    logs, shown = other.prediction(part).log, seen.prediction(part).log
    for log in np.unique(logs):  # another filter has other edges
        rows, own = np.flatnonzero(shown == log), np.flatnonzero(logs == log)
        at = np.minimum(np.searchsorted(theirs[own], mine[rows]), len(own) - 1)
        same = theirs[own[at]] == mine[rows]
        predicted[rows[same]], left[rows[same]] = (v[own[at[same]]] for v in (torque, residual))
    return (predicted, left) if np.isfinite(predicted).mean() > 0.5 else None


def rms(values) -> float | None:
    """Root mean square of the numbers among values; None where there is none."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else None
