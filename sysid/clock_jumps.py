"""Jumps of acceleration that a log has at another time than the torque's.

What all joints do at once within a period of the frequency above which a clock was read off passes
in part for the clock's: of a jump, which they make together, the correction takes a part away and
leaves it spread over half a period to either side. No wave of a filter is left there. But the
torque has its step, and about it accelerations change as the torque does.

Where stamps were right the torque is logged from sample to sample, and drives change it more often:
when between two samples it jumped no log tells, while the angles have moved from then on.

Source: Frisch & Waugh 1933 (what is left of both without what is slow, compared).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .motion import Piece
from .outliers import CHANCE, NORMAL, SPIKE
from .running import running

SHARE = 0.35  # of a step's square, without what is slow: what a ramp of 0.6 half periods has of it
_SLOW = 3  # order of the polynomial that a smooth motion is in two periods
LIGHT = 0.02  # of a torque's spread over an acceleration's: an arm's inertia is more


def without_jumps(piece: Piece, step: float) -> Piece:
    """A piece under a low-pass on both sides without the rows about jumps of acceleration that were
    logged at another time than the torque's: by the correction of its clock, or within the time
    from sample to sample, `step` [s], of which a log does not tell when in it a torque jumped."""
    low, level = piece.smoother, running(piece.measured, 2 * SPIKE + 1, "median", "edge")
    told = level - piece.tau
    noise = np.median(np.abs(told), axis=0) / NORMAL
    least = np.sqrt(2.0 * np.log(told.size / CHANCE)) * noise
    reach = int(np.ceil(piece.clock / piece.step)) or low.reach
    # what the low-pass leaves of a step that comes as much later or earlier, and of noise
    error = step / np.sqrt(12.0) * low.weights[low.reach :] / piece.step
    kept = np.sqrt(np.sum(low.weights**2) * step / piece.step)
    use = np.ones(told.shape, dtype=bool) if piece.use is None else piece.use.copy()
    for j, own in enumerate(told.T):
        about = level[:, j], piece.qdd, reach, (j, light(level[:, j], piece.qdd[:, j]))
        at, size = spread(own, least[j], *about)
        # a step is twice as high as what it differs from its low-pass by
        far = np.sum(2.0 * np.outer(size, error) > kept * noise[j], axis=1)
        use[:, j] &= ~within(at, np.full(len(at), reach + 1) if piece.clock else far, len(own))
    return replace(piece, use=use)


def light(torque: np.ndarray, qdd: np.ndarray) -> float:
    """The least inertia that can be a joint's, of its torque (n,) and its acceleration (n,): what
    moves it with less than a fiftieth of what its torque does for as much acceleration is none."""
    size = np.std(qdd) if len(qdd) else 0.0
    return float(LIGHT * np.std(torque) / size) if size > 0.0 else 0.0


def within(at: np.ndarray, reach: np.ndarray, n: int) -> np.ndarray:
    """(n,) bool: the rows that are less than `reach` (k,) rows from one of `at` (k,)."""
    edges = np.zeros(n + 1, dtype=int)
    np.add.at(edges, np.clip(at - reach + 1, 0, n), 1)
    np.add.at(edges, np.clip(at + reach, 0, n), -1)
    return np.cumsum(edges[:-1]) > 0


def spread(
    told: np.ndarray, least: float, torque, qdd, reach: int, inertia: tuple[int, float] = (0, 0.0)
) -> tuple[np.ndarray, np.ndarray]:
    """The rows (jumps,) where a torque jumps as an acceleration does, and by how much (jumps,).

    Args:
        told: (n,) how far the torque jumps at each row, zero where that does not count; least: what
            its noise may be. torque: (n,) as logged, without spikes; qdd: (n, dof); both are
            compared a period, 2 `reach` rows, to either side, and half of one at a log's ends.
            inertia: the joint's number, and the least that its torque is beside its acceleration.
    """
    size = np.abs(told)
    size[:reach] = size[max(len(size) - reach, 0) :] = 0.0
    # the greatest within half a period
    at = np.flatnonzero((size > least) & (size >= running(size, 2 * reach + 1, "max")))
    about = [slice(max(0, k - 2 * reach), k + 2 * reach + 1) for k in at.tolist()]
    alike = [_most_alike(_fast(torque[own]), _fast(qdd[own]), *inertia) for own in about]
    at = at[np.array(alike, dtype=float) > SHARE]
    return at, size[at]


def _fast(values: np.ndarray) -> np.ndarray:
    """Values (n, ...) without the nearest polynomial of the third order: what a smooth motion does
    in so short a time."""
    rows = np.linspace(-1.0, 1.0, len(values))
    slow = np.linalg.qr(np.vander(rows, _SLOW + 1))[0]
    return values - slow @ (slow.T @ values)


def _most_alike(torque: np.ndarray, qdd: np.ndarray, own: int, least: float) -> float:
    """The largest share of a torque's square (n,) that one of the accelerations (n, dof) has; none
    of a torque that is too small for its own joint's."""
    if np.linalg.norm(torque) < least * np.linalg.norm(qdd[:, own]):
        return 0.0
    squares = np.sum(qdd**2, axis=0) * np.sum(torque**2)
    return float(np.max((torque @ qdd) ** 2 / np.maximum(squares, 1e-300), initial=0.0))
