"""Rows that only repeat the angles and torques of the one before while the robot moves: messages that
did not arrive. They are no samples, and are left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .outliers import SHORT, runs
from .recording import Recording
from .repeats import held_angle
from .segment import gaps
from .warned import warn

_FEWEST = 4  # rows: fewer may be alike by chance


def without_held(samples: Recording) -> Recording:
    """Samples without rows in which nothing came, which is told."""
    q, tau = samples.signals["q"], samples.signals["tau"]
    if len(q) < SHORT:
        return samples
    again = np.all(np.diff(q, axis=0) == 0.0, axis=1) & np.all(np.diff(tau, axis=0) == 0.0, axis=1)
    apart = np.union1d(samples.breaks, gaps(samples.t)).astype(int)
    again[apart - 1] = False
    found = {
        (a, b + 1) for a, b in runs(again) if b - a + 1 >= _FEWEST
    }  # the sample and its repeats
    if not found:
        return samples
    # a joint at least went on as it came, and made up for it at once
    moved = sorted(found & {run for own in q.T for run in held_angle(own)})
    moved = [(a + 1, b) for a, b in moved if not np.any((apart > a) & (apart <= b + 1))]
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
    signals = {name: values[kept] for name, values in samples.signals.items()}
    breaks = place[samples.breaks]
    return replace(samples, t=samples.t[kept], signals=signals, breaks=breaks, empty=())
