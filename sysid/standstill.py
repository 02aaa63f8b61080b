"""Rows in which friction may have any value: standstill, and what a filter smears about reversals."""

from dataclasses import replace

import numpy as np

from .jumps import jumps
from .motion import NOISE_TRAVEL, Piece
from .smoother import Smoother
from .specs import PreprocessSpec

# `standstill: mask` leaves a joint's rows out below this share of its own rms speed, at most 0.03 rad/s or m/s:
# there friction may have any value up to its greatest.
_STANDSTILL_SHARE, STANDSTILL_MOST = 0.05, 0.03


def without_standstill(piece: Piece, threshold, reach: int) -> Piece:
    """The piece without the rows where a joint is slower than its threshold (dof,) or (n, dof) [rad/s or m/s], or within `reach` rows of one.

    A filter that sees so far carries standstill into them.
    """
    still = np.abs(piece.qd) < threshold
    count = np.cumsum(np.concatenate([np.zeros((1, still.shape[1])), still]), axis=0)
    rows = np.arange(len(still))
    low, high = np.maximum(rows - reach, 0), np.minimum(rows + reach + 1, len(still))
    use = count[high] == count[low]
    return replace(piece, use=use if piece.use is None else use & piece.use)


def clear_of_reversals(pieces, spec: PreprocessSpec) -> list[Piece]:
    """The pieces without each joint's rows that the filter has bent about its reversals and jumps of its torque, or in which it
    may stand still.

    A joint may stand where its speed changes sign; where it is less than the filter makes of a stop amid accelerations as
    large as those about it; and where the angle travels less, while the filter sees it, than its own noise would make it.
    Where velocity was logged nobody knows how well: there it is as with `mask`.
    """
    if spec.filter == "none":
        threshold = standstill_speed(pieces)
        return [without_standstill(piece, np.where(turns(piece.qd), np.inf, threshold), 0) for piece in pieces]
    out = []
    for piece in pieces:
        smoother = Smoother(spec, piece.step)
        reach, stop = smoother.smear(piece.smoother is not None)
        seen = (2 * smoother.reach + 1) * piece.step
        threshold = np.maximum(stop * _largest_about(piece.qdd, smoother.reach), NOISE_TRAVEL * piece.noise / seen)
        bent = turns(piece.qd) | jumps(piece.measured, smoother.reach)
        out.append(without_standstill(piece, np.where(bent, np.inf, threshold), reach))
    return out


def turns(qd) -> np.ndarray:
    """(n, dof) bool: the speed has another sign in the row before or after."""
    change = np.sign(qd[1:]) != np.sign(qd[:-1])
    out = np.zeros(qd.shape, dtype=bool)
    out[1:], out[:-1] = change, out[:-1] | change
    return out


def _largest_about(values, reach: int) -> np.ndarray:
    """The largest size (n, dof) of the values within `reach` rows of each."""
    n, width, span = len(values), 2 * reach + 1, 1
    largest = np.pad(np.abs(values), ((reach, reach), (0, 0)))
    while 2 * span <= width:  # of windows twice as long, time after time
        largest[:-span] = np.maximum(largest[:-span], largest[span:])
        span *= 2
    return np.maximum(largest[:n], largest[width - span : width - span + n])


def standstill_speed(pieces) -> np.ndarray:
    """Speed (dof,) below which a joint counts as standing, from its own rms speed."""
    square = sum(np.sum(p.qd[p.core] ** 2, axis=0) for p in pieces) / sum(p.samples for p in pieces)
    return slow(square)


def slow(square) -> np.ndarray:
    """`standstill_speed` (dof,) of joints whose speed has the mean square `square`."""
    return np.minimum(_STANDSTILL_SHARE * np.sqrt(square), STANDSTILL_MOST)
