"""How sure each parameter is, and whether the data or the prior said it.

Residuals of smoothed signals are correlated over time, so the noise of the estimate is not taken from single samples
but from what leaving a whole block out would change (a jackknife, which also allows for blocks that few others stand
in for), with the products of neighbouring blocks, as correlation does not stop at a block's edge. The prior enters as
what it claims to know:

    d_b = (H - 2 R_b'R_b)^-1 s_b,      H = 2 R'R + P,  P the prior's Hessian, s_b the block's score,
    cov = sum_b sum_l w_l d_b d_(b+l)' + 2 sigma^2 H^-1 P H^-1,      w_0 = 1, w_1 = 2/3, w_2 = 1/3.

Source: Cameron & Miller 2015 (jackknife of clusters); Newey & West 1987 (neighbours).
"""

from dataclasses import dataclass

import numpy as np

from .compress import Compressed
from .objective import Objective, add_blocks


@dataclass(frozen=True)
class Uncertainty:
    """covariance (size, size) in the parameters' units; std (size,), NaN where nothing determines a parameter;
    from_data (size,), the share of a parameter's variance that is measurement noise rather than the prior's
    width: 1 where the data alone determine it, 0 where only the prior does."""

    covariance: np.ndarray
    std: np.ndarray
    from_data: np.ndarray


def estimate(objective: Objective, compressed: Compressed, x: np.ndarray, fixed: np.ndarray, weights) -> Uncertainty:
    """Uncertainty at the optimum x (size,).

    Args:
        fixed: (size,) bool, parameters that were held, or sit at a bound; they get no std.
        weights: (joints,) of the fit, or None.
    """
    size = len(x)
    free = np.flatnonzero(~fixed)
    data = objective.data_hessian()
    prior = add_blocks(np.zeros((size, size)), objective.prior_hessian(x)) if objective.weight else np.zeros((size, size))
    misfit = objective.misfit(x)
    variance = float(misfit @ misfit) / max(int(compressed.rows.sum()) - len(free), 1)
    pick = np.ix_(free, free)
    inverse, undetermined = _inverse(data[pick] + prior[pick])
    covariance = np.full((size, size), np.nan)
    moves = _left_out(compressed, x, weights, data + prior, free)
    covariance[pick] = _neighbours(moves) + 2.0 * variance * inverse @ prior[pick] @ inverse
    total = np.diagonal(inverse)
    from_noise = np.einsum("ij,jk,ki->i", inverse, data[pick], inverse)
    share = np.zeros(size)
    share[free] = np.where(undetermined, 0.0, np.clip(from_noise / np.where(total > 0, total, 1.0), 0.0, 1.0))
    std = np.full(size, np.nan)
    std[free] = np.where(undetermined, np.nan, np.sqrt(np.clip(np.diagonal(covariance)[free], 0.0, None)))
    return Uncertainty(covariance, std, share)


_NEIGHBOURS = {1: 2.0 / 3.0, 2: 1.0 / 3.0}


def _left_out(compressed: Compressed, x, weights, hessian, free) -> np.ndarray:
    """(blocks, free) change of the estimate when a block is left out, to first order in the prior's curvature."""
    scores = compressed.scores(x, weights)
    own = np.zeros((compressed.blocks,) + hessian.shape)
    for factor in compressed.factors:
        scale = 2.0 if weights is None else 2.0 * weights[factor.joint] ** 2
        own[factor.block][np.ix_(factor.columns, factor.columns)] += scale * factor.triangle[:, :-1].T @ factor.triangle[:, :-1]
    moves = np.zeros((compressed.blocks, len(free)))
    pick = np.ix_(free, free)
    for b in range(compressed.blocks):
        moves[b] = _inverse((hessian - own[b])[pick])[0] @ scores[b, free]
    return moves * np.sqrt(max(compressed.blocks - 1, 1) / compressed.blocks)


def _neighbours(moves: np.ndarray) -> np.ndarray:
    total = moves.T @ moves
    for lag, weight in _NEIGHBOURS.items():
        product = moves[:-lag].T @ moves[lag:]
        total = total + weight * (product + product.T)
    return total


def _inverse(hessian):
    """Inverse of a scaled positive semidefinite matrix on its range, and which parameters leave that range."""
    scale = np.sqrt(np.where(np.diagonal(hessian) > 0.0, np.diagonal(hessian), 1.0))
    values, vectors = np.linalg.eigh(hessian / np.outer(scale, scale))
    flat = values < 1e-12 * values[-1]
    inverse = (vectors[:, ~flat] / values[~flat]) @ vectors[:, ~flat].T / np.outer(scale, scale)
    leaves = (np.sum(vectors[:, flat] ** 2, axis=1) > 1e-6) | (np.diagonal(hessian) <= 0.0)
    return inverse, leaves
