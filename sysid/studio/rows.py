"""Rows of logs that two models predict, laid over each other."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..prediction import Prediction

Columns = tuple[np.ndarray, np.ndarray, np.ndarray]  # measured, predicted, residual, (n,) each


def columns(found: Prediction, joint: int) -> Columns:
    """What a prediction says of a joint, each in one piece of memory; the residual is NaN where a
    row does not count."""
    own = (np.ascontiguousarray(v[:, joint]) for v in (found.measured, found.predicted))
    return *own, found.counted_residual(joint)


class Shown(Protocol):
    """What can be laid over a fit."""

    def prediction(self, part: str) -> Prediction:
        """Of a part of the logs."""

    def told(self, part: str) -> list[float | None]:
        """The RMS of each joint on it."""

    def columns(self, part: str, joint: int) -> Columns:
        """Of a joint, as the function of this name has it."""


def same_rows(other: Shown, seen: Shown, part: str, joint: int):
    """Predicted torque and residual (n,) of another model on the rows in sight, NaN where it has
    none of them; None where its logs are others."""
    theirs, mine = other.prediction(part), seen.prediction(part)
    if mine.t.shape == theirs.t.shape and np.array_equal(mine.t, theirs.t):
        return other.columns(part, joint)[1:]
    predicted, left = np.full(len(mine.t), np.nan), np.full(len(mine.t), np.nan)
    _, torque, residual = other.columns(part, joint)
    for log in np.unique(theirs.log):  # another filter has other edges
        rows, own = np.flatnonzero(mine.log == log), np.flatnonzero(theirs.log == log)
        at = np.minimum(np.searchsorted(theirs.t[own], mine.t[rows]), len(own) - 1)
        same = theirs.t[own[at]] == mine.t[rows]
        predicted[rows[same]], left[rows[same]] = (v[own[at[same]]] for v in (torque, residual))
    return (predicted, left) if np.isfinite(predicted).mean() > 0.5 else None


def rms(values) -> float | None:
    """Root mean square of the numbers among values; None where there is none."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else None
