"""Rows in which friction may have any value: standstill, and what a filter smears about reversals."""

from dataclasses import replace

import numpy as np

from .jumps import jumps
from .motion import NOISE_TRAVEL, Blur, Piece
from .smoother import Smoother
from .specs import PreprocessSpec

# `standstill: mask` leaves a joint's rows out below this share of its own rms speed, at most 0.03 rad/s or m/s:
# there friction may have any value up to its greatest.
_STANDSTILL_SHARE, STANDSTILL_MOST = 0.05, 0.03
_SETTLES = 3e-4  # rad: one minute of arc, what makers of robot gears state as lost motion; m: as far at an arm's length


def without_standstill(piece: Piece, threshold, reach: int) -> Piece:
    """The piece without the rows where a joint is slower than its threshold (dof,) or (n, dof) [rad/s or m/s], or within `reach` rows of one.

    A filter that sees so far carries standstill into them.
    """
    return _without(piece, np.abs(piece.qd) < threshold, reach)


def clear_of_reversals(pieces, spec: PreprocessSpec) -> list[Piece]:
    """The pieces without each joint's rows that the filter has bent about its reversals and about jumps of accelerations, or in
    which it may stand still.

    A joint may stand where its speed changes sign; where it is less than the filter makes of a stop amid accelerations as
    large as those about it; where the angle travels less, while the filter sees it, than its own noise would make it; and behind
    each of these until it has gone as far as friction takes to be that of sliding: a controller that lost its command creeps.
    Where velocity was logged nobody knows how well: there it is as with `mask`.
    """
    if spec.filter == "none":
        threshold = standstill_speed(pieces)
        return [without_standstill(piece, np.where(turns(piece.qd), np.inf, threshold), 0) for piece in pieces]
    smoothers = [Smoother(spec, piece.step) for piece in pieces]
    pieces = [replace(p, blur=Blur(*own.smear(p.smoother is not None), own.reach)) for p, own in zip(pieces, smoothers)]
    still = [_may_stand(piece, piece.qd, piece.qdd, piece.noise) for piece in pieces]
    moving = [_sliding(own, piece.q, piece) & (True if piece.use is None else piece.use) for own, piece in zip(still, pieces)]
    bent = jumps(pieces, smoothers, moving)
    return [replace(piece, use=own & ~rows) for piece, own, rows in zip(pieces, moving, bent)]


def sliding(piece: Piece, over: np.ndarray) -> np.ndarray:
    """(n,) bool: the rows on which none of the speeds that are sums `over` (k, dof) of the joints' may be none, and about which the
    filter has not bent what changes with its sign. All of them where none were left out about the joints' own reversals.
    """
    if piece.blur is None:
        return np.ones(len(piece.t), dtype=bool)
    sums = (piece.qd @ over.T, piece.qdd @ over.T, np.abs(over) @ piece.noise)
    return _sliding(_may_stand(piece, *sums), piece.q @ over.T, piece).all(axis=1)


def _may_stand(piece: Piece, qd, qdd, noise) -> np.ndarray:
    """(n, k) bool: where speeds (n, k), of such accelerations and noise (k,) of the angle, may be none."""
    seen = (2 * piece.blur.look + 1) * piece.step
    threshold = np.maximum(piece.blur.stop * _largest_about(qdd, piece.blur.look), NOISE_TRAVEL * noise / seen)
    return turns(qd) | (np.abs(qd) < threshold)


def _sliding(still: np.ndarray, q: np.ndarray, piece: Piece) -> np.ndarray:
    """(n, k) bool: the rows that the filter carries none of `still` into, and by which the angle (n, k) has gone as far behind the last of
    them as friction takes to settle."""
    out = _apart(still, piece.blur.reach)
    for j, stands in enumerate(still.T):
        moves = np.flatnonzero(np.diff(np.concatenate([[1], stands, [1]]).astype(int)))  # first rows of runs that move, and the rows behind
        for first, last in moves.reshape(-1, 2):
            if first:  # whether it stood before the piece nobody knows
                gone = np.abs(q[first:last, j] - q[first - 1, j]) >= _SETTLES
                out[first : first + np.argmax(gone) if gone.any() else last, j] = False
    return out


def _without(piece: Piece, still: np.ndarray, reach: int) -> Piece:
    use = _apart(still, reach)
    return replace(piece, use=use if piece.use is None else use & piece.use)


def _apart(still: np.ndarray, reach: int) -> np.ndarray:
    """(n, k) bool: the rows without one of `still` within `reach` rows."""
    count = np.cumsum(np.concatenate([np.zeros((1, still.shape[1]), dtype=int), still]), axis=0)
    rows = np.arange(len(still))
    low, high = np.maximum(rows - reach, 0), np.minimum(rows + reach + 1, len(still))
    return count[high] == count[low]


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
