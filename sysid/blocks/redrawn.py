"""Coefficients that blocks tell, drawn anew from noise alone."""

from __future__ import annotations

import numpy as np

_FOURTH = 3.0  # moment of a normal variable
_OTHERS = 1e-12  # of a direction: what is left of it, however much of it one block holds


def left_out(squares: np.ndarray) -> np.ndarray:
    """(1 - G_b)^-1 (..., k, k) of squares that sum to one over blocks; of a direction that one
    block holds all of, a factor so large that whatever that block says counts for nothing."""
    return np.linalg.inv((1.0 + _OTHERS) * np.eye(squares.shape[-1]) - squares)


def redrawn(moves: np.ndarray, noise: np.ndarray):
    """Draws of what noise as loud, block by block, tells where nothing is there: the square (draws,
    groups) of the coefficients, and the spread (draws, groups) that blocks would tell of them.

    Blocks are long, so their sums are normal, and what they add to a coefficient says nothing of
    how far they scatter (Cochran 1934). A move's square already scatters about what it tells, three
    times as wide as its like: a draw's spread scatters by as much less.

    Args:
        moves: (groups, blocks, k). noise: (2, draws, blocks) normal variables, for one and the
            other.
    """
    told, size = np.einsum("db,gbk->dgk", noise[0], moves, optimize=True), np.sum(moves**2, axis=2)
    own = 1.0 + (noise[1] ** 2 - 1.0) / np.sqrt(_FOURTH)
    return np.sum(told**2, axis=2), own @ size.T


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


def chance_among(statistic: float, greatest: np.ndarray) -> float:
    """Family-wise p-value of a statistic beside the greatest (draws,) of all of nothing there; one
    of what cannot be tested."""
    return float((1 + np.sum(~(greatest < statistic))) / (1 + len(greatest)))
