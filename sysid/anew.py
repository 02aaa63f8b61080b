"""Where one file goes on with another recording, as all angles jump at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .full_turns import jumps
from .outliers import SHORT, quantum
from .recording import Recording
from .stamps import long_enough
from .warned import warn

_FARTHER = 3.0  # times as far as in any other step: no motion does that on several joints at once
_MOST = 0.001  # of the steps: what comes oftener is the logger's way
_LOST = 1.5  # steps: in longer ones samples are missing
_GRAINS = 2.5  # quanta: what a resting joint's noise jumps by


def apart(samples: Recording, prismatic) -> Recording:
    """Samples with a break where all angles jump, which is said."""
    found = angle_starts(samples.t, samples.signals["q"], samples.breaks, ~np.asarray(prismatic))
    if not len(found):
        return samples
    at = ", ".join(f"{samples.t[row]:.4g}" for row in found[:4]) + ", ..." * (len(found) > 4)
    warn(
        f"{samples.where}: the angles of most joints jump at once at {at} s: what comes from there on is taken as a recording of its own",
        above=2,
    )
    return replace(samples, breaks=np.union1d(samples.breaks, found))


def angle_starts(t, q, breaks, turns) -> np.ndarray:
    """Rows before which most of the joints that move, two at least, jump farther than they move
    anywhere else between two samples.

    Args:
        t (n,), q (n, dof). breaks: rows at which another recording begins, as is known. turns:
            (dof,) bool, the joints whose angles [rad] may be wrapped within a turn.
    """
    steps = np.diff(q, axis=0)
    if len(steps) < SHORT:
        return np.zeros(0, dtype=int)
    clock = np.diff(t)
    asked = clock <= _LOST * np.median(clock)  # over what is missing any joint goes far
    asked[np.asarray(breaks, dtype=int) - 1] = False
    far = np.stack([_far(own, asked, bool(turn)) for own, turn in zip(steps.T, turns)], axis=1)
    far[1:] &= np.any(steps[:-1] != 0.0, axis=1)[:, None]  # else a reading that stood still goes on
    far &= np.abs(steps) > _GRAINS * np.array([quantum(own) for own in q.T])
    moving = int(np.sum(np.ptp(q, axis=0) > 0.0))
    count = far.sum(axis=1)
    found = np.flatnonzero((count >= 2) & (2 * count > moving)) + 1
    return found[long_enough(found, breaks, len(t))]  # a few rows are no recording


def _far(steps, asked, turns: bool) -> np.ndarray:
    """Which steps (n,) of an angle are clearly farther than all others, of those that are asked."""
    size = np.where(asked, np.abs(steps), 0.0)
    if turns:
        size[jumps(steps)] = 0.0
    most = max(2, round(_MOST * len(size)))
    last = np.sort(size)[::-1][: most + 1]
    (gaps,) = np.nonzero(last[:-1] > _FARTHER * last[1:])
    return size >= last[gaps[0]] if len(gaps) else np.zeros(len(size), dtype=bool)
