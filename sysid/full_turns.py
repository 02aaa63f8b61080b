"""Angles that were logged within one turn: they jump by a turn where the joint goes on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .recording import Recording
from .segment import gaps
from .warned import warn

TURN = 2.0 * np.pi  # rad
ADVICE = "a fit takes it to go on, and says so; better unwrap it (numpy.unwrap) before it is logged"
_NEAR = 0.1  # of a turn: what a joint moves by beside the jump, and what moves by less in most steps


def jumps(moved: np.ndarray) -> np.ndarray:
    """Which steps (n,) or (n, dof) from sample to sample [rad] are jumps by a turn."""
    return np.abs(np.abs(moved) - TURN) < _NEAR * TURN


def going_on(samples: Recording, joints: tuple[str, ...], prismatic) -> Recording:
    """Samples in SI units whose angles go on where they jumped by a turn, which is said."""
    # nobody knows how far a joint turned in a gap
    bounds = [0, *np.union1d(samples.breaks, gaps(samples.t)).astype(int).tolist(), len(samples.t)]
    q, found = unwrapped(samples.signals["q"], ~np.asarray(prismatic), list(zip(bounds, bounds[1:])))
    for j in found:
        warn(f"{samples.where}: the angle of joint {joints[j]!r} jumps by a turn, and is taken to go on (numpy.unwrap)", above=2)
    return replace(samples, signals=samples.signals | {"q": q}) if found else samples


def followed(q: np.ndarray, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """An angle and its command (n,) [rad] of one recording that go on where the angle jumped by a turn, the command within half a turn of it; both
    as they are where none does."""
    own, found = unwrapped(q[:, None], [True], [(0, len(q))])
    if not found:
        return q, command
    ahead = command - q
    return own[:, 0], own[:, 0] + ahead - TURN * np.round(ahead / TURN)


def unwrapped(q: np.ndarray, turns, parts: Sequence[tuple[int, int]]) -> tuple[np.ndarray, list[int]]:
    """Angles (n, dof) [rad] that go on where they jumped by a turn, and the joints that did; the angles themselves where none does.

    Args:
        turns: (dof,) bool, the joints whose positions are angles. parts: first row and the one behind the last of what was recorded in one go.
    """
    found, out = [], q
    for j in np.flatnonzero(turns).tolist():
        moved = np.diff(q[:, j])
        moved[[first - 1 for first, _ in parts if first]] = 0.0  # another recording
        jumped = jumps(moved)
        if not jumped.any() or np.median(np.abs(moved)) > _NEAR * TURN:
            continue
        out = q.copy() if out is q else out
        out[1:, j] -= np.cumsum(np.where(jumped, np.sign(moved) * TURN, 0.0))
        found.append(j)
    return out, found
