"""Jumps of acceleration in logs whose stamps were corrected.

What all joints do at once within a period of the frequency above which a clock was read off passes
in part for the clock's: of a jump, which they make together, the correction takes a part away and
leaves it spread over half a period to either side. No wave of a filter is left there. But the
torque has its step, and about it accelerations change as the torque does.

Source: Frisch & Waugh 1933 (what is left of both without level and slope, compared).
"""

from __future__ import annotations

import numpy as np

MOST = 0.5  # of the square of what a torque does there, which is a jump's


def spread(
    told: np.ndarray, least: float, torque, qdd, reach: int
) -> tuple[np.ndarray, np.ndarray]:
    """The rows (jumps,) where a torque jumps together with an acceleration, and by how much (jumps,).

    Args:
        told: (n,) how far the torque jumps at each row, zero where that does not count; least: what
            its noise may be. torque: (n,) as logged, without spikes; qdd: (n, dof); both are
            compared a period, 2 `reach` rows, to either side, and half of one at a log's ends.
    """
    at = _greatest(np.abs(told), least, reach)
    at = at[(at >= reach) & (at < len(told) - reach)]
    about = [slice(max(0, k - 2 * reach), k + 2 * reach + 1) for k in at.tolist()]
    alike = [_most_alike(_beside_line(torque[own]), _beside_line(qdd[own])) for own in about]
    at = at[np.array(alike, dtype=float) > MOST]
    return at, np.abs(told[at])


def _beside_line(values: np.ndarray) -> np.ndarray:
    """Values (n, ...) without their level and slope."""
    rows = np.arange(len(values), dtype=float)
    line = np.linalg.qr(np.stack([np.ones_like(rows), rows], axis=1))[0]
    return values - line @ (line.T @ values)


def _greatest(size: np.ndarray, least: float, apart: int) -> np.ndarray:
    """The rows of values (n,) above some, the greatest first, none so near to a greater one."""
    size, out = size.copy(), list[int]()
    while size[k := int(np.argmax(size))] > least:
        out.append(k)
        size[max(0, k - apart) : k + apart + 1] = 0.0
    return np.array(out, dtype=int)


def _most_alike(torque: np.ndarray, qdd: np.ndarray) -> float:
    """The largest share of a torque's square (n,) that one of the accelerations (n, dof) has."""
    squares = np.sum(qdd**2, axis=0) * np.sum(torque**2)
    return float(np.max((torque @ qdd) ** 2 / np.maximum(squares, 1e-300), initial=0.0))
