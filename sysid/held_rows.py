"""Rows that only repeat the one before, in every column, while the robot moves: messages that did not
arrive. They are no samples, and are left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .outliers import SHORT, quantum, runs
from .recording import Recording
from .warned import warn

_FEWEST = 4  # rows: fewer may be alike by chance
_GRAINS = 2.5  # quanta by which an angle is elsewhere when it goes on: it moved meanwhile
_OFTEN = 0.5  # of the rows: what comes more often is how the logger writes


def without_held(samples: Recording) -> Recording:
    """Samples without rows in which nothing came, which is told."""
    q, tau = samples.signals["q"], samples.signals["tau"]
    if len(q) < SHORT:
        return samples
    again = np.all(np.diff(q, axis=0) == 0.0, axis=1) & np.all(np.diff(tau, axis=0) == 0.0, axis=1)
    again[samples.breaks - 1] = False
    found = [(a + 1, b + 1) for a, b in runs(again) if b - a + 1 >= _FEWEST]
    if not found or again.sum() > _OFTEN * len(q):
        return samples
    grain = _GRAINS * np.array([quantum(own) for own in q.T])
    moved = [(a, b) for a, b in found if np.any(np.abs(q[min(b + 1, len(q) - 1)] - q[a]) > grain)]
    if not moved:
        return samples
    kept = np.ones(len(q), dtype=bool)
    for a, b in moved:
        kept[a : b + 1] = False
    count = len(q) - int(kept.sum())
    warn(
        f"{samples.where}: {count} rows, {len(moved)} times, only repeat the row before while the "
        f"robot moves, the first at {samples.t[moved[0][0]]:.4g} s: messages that did not arrive, "
        "which are left out",
        above=2,
    )
    place = np.cumsum(kept) - kept  # how many of the rows before each are kept
    empty = tuple(
        (j, int(place[a]), max(int(place[b + 1 if b + 1 < len(q) else b]) - 1, int(place[a])))
        for j, a, b in samples.empty
    )
    signals = {name: values[kept] for name, values in samples.signals.items()}
    return replace(
        samples, t=samples.t[kept], signals=signals, breaks=place[samples.breaks], empty=empty
    )
