"""Coefficients of columns that are orthonormal over all blocks, from the blocks' sums: how far each
block moves them, and what they take of blocks that they were not fitted on.

Of sums s_b, G_b with c = sum_b s_b, for one group of columns or for many at once.
"""

from __future__ import annotations

import numpy as np

from .numbering import folds
from .redrawn import left_out


def moves(c, loud, loud_squares, squares) -> np.ndarray:
    """(..., blocks, k) of coefficients c (..., k)."""
    own = loud - np.einsum("...bkl,...l->...bk", loud_squares, c)
    return np.einsum("...bkl,...bl->...bk", left_out(squares), own)


def taking_part(moves) -> np.ndarray:
    """How many take part in moves (..., blocks, k)."""
    spread = np.swapaxes(moves, -1, -2) @ moves
    whole = np.trace(spread, axis1=-2, axis2=-1)
    return whole**2 / np.maximum(np.sum(spread**2, axis=(-2, -1)), 1e-300)


def gains(c, scores, squares, own=None) -> np.ndarray:
    """(..., folds) of coefficients c (..., k) with scores (..., blocks, k); the last block, the
    prior, is in no fold.

    Args:
        own: scores and squares of those rows whose gain is asked; None: of all.
    """
    first = np.flatnonzero(np.diff(folds(scores.shape[-2] - 1), prepend=-1))

    def by_fold(scores, squares):
        s = np.add.reduceat(scores[..., :-1, :], first, axis=-2)
        return s, np.add.reduceat(squares[..., :-1, :, :], first, axis=-3)

    s, g = by_fold(scores, squares)
    system = (1.0 + 1e-9) * np.eye(s.shape[-1]) - g
    rest = np.linalg.solve(system, (c[..., None, :] - s)[..., None])[..., 0]
    s, g = (s, g) if own is None else by_fold(*own)
    return 2.0 * np.sum(rest * s, axis=-1) - np.einsum("...fi,...fij,...fj->...f", rest, g, rest)
