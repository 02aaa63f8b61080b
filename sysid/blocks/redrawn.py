"""Coefficients that blocks tell, their blocks' signs drawn anew."""

from __future__ import annotations

import numpy as np


def left_out(squares: np.ndarray) -> np.ndarray:
    """(1 - G_b)^-1 (..., k, k) of squares that sum to one over blocks."""
    return np.linalg.inv(np.eye(squares.shape[-1]) - squares)


def redrawn(squares: np.ndarray, moves: np.ndarray, sign: np.ndarray):
    """What draws tell that keep the size of every block's move: the square (draws, groups) of the
    coefficients, and the spread (draws, groups) of the moves after each draw's own refit.

    Args:
        squares: (groups, blocks, k, k). moves: (groups, blocks, k). sign: (draws, blocks).
    """
    out = left_out(squares)
    # what a draw's own scores move by, before its refit
    again = np.einsum("gbkl,gbl->gbk", out, moves)
    pulled = out @ squares
    after = np.einsum("gbkl,gbl->gbk", pulled, again)
    twice = np.einsum("gbkl,gblm->gkm", pulled, pulled, optimize=True)
    count, b, k = moves.shape
    flat = lambda a: np.moveaxis(a, 1, 0).reshape(b, count * k)  # noqa: E731
    c = (sign @ flat(moves)).reshape(-1, count, k)
    u = (sign @ flat(after)).reshape(-1, count, k)
    size = sign**2 @ np.sum(again**2, axis=2).T
    spread = size - 2.0 * np.sum(c * u, axis=2)
    spread += np.einsum("dgk,gkl,dgl->dg", c, twice, c, optimize=True)
    return np.sum(c * c, axis=2), np.maximum(spread, 1e-9 * size)


def normal_scores(statistic, directions, rest) -> np.ndarray:
    """F ratios with `directions` and `rest` degrees of freedom on the scale of a normal variable
    (Wilson & Hilferty 1931)."""
    one, two = 2.0 / (9.0 * directions), 2.0 / (9.0 * rest)
    root = np.cbrt(statistic)
    return ((1.0 - two) * root - (1.0 - one)) / np.sqrt(two * root**2 + one)


def ratio_at(score: float, directions: float, rest: float) -> float:
    """The F ratio whose normal score is `score`, or zero where that is less; infinity where none is
    as much."""
    score, one, two = max(score, 0.0), 2.0 / (9.0 * directions), 2.0 / (9.0 * rest)
    lead, half = (1.0 - two) ** 2 - two * score**2, (1.0 - two) * (1.0 - one)
    if not (score < np.inf and lead > 0.0):
        return np.inf
    left = max(half**2 - lead * ((1.0 - one) ** 2 - one * score**2), 0.0)
    return float(((half + np.sqrt(left)) / lead) ** 3)
