"""How sure each parameter is, and whether the data or the prior said it.

Residuals of smoothed signals are correlated over time, so the noise of the estimate is taken from the scores of
whole blocks (a sandwich), not from single samples. The prior enters as what it claims to know:

    cov = H^-1 (sum_b s_b s_b' + 2 sigma^2 P) H^-1,    H = 2 R'R + P,  P the prior's Hessian.

Source: Cameron & Miller 2015 (cluster-robust variance); White 1980.
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
    scores = compressed.scores(x, weights)
    meat = scores.T @ scores * compressed.blocks / max(compressed.blocks - 1, 1)
    data = objective.data_hessian()
    prior = add_blocks(np.zeros((size, size)), objective.prior_hessian(x)) if objective.weight else np.zeros((size, size))
    misfit = objective.misfit(x)
    variance = float(misfit @ misfit) / max(int(compressed.rows.sum()) - len(free), 1)
    pick = np.ix_(free, free)
    inverse, undetermined = _inverse(data[pick] + prior[pick])
    covariance = np.full((size, size), np.nan)
    covariance[pick] = inverse @ (meat[pick] + 2.0 * variance * prior[pick]) @ inverse
    total = np.diagonal(inverse)
    from_noise = np.einsum("ij,jk,ki->i", inverse, data[pick], inverse)
    share = np.zeros(size)
    share[free] = np.where(undetermined, 0.0, np.clip(from_noise / np.where(total > 0, total, 1.0), 0.0, 1.0))
    std = np.full(size, np.nan)
    std[free] = np.where(undetermined, np.nan, np.sqrt(np.clip(np.diagonal(covariance)[free], 0.0, None)))
    return Uncertainty(covariance, std, share)


def _inverse(hessian):
    """Inverse of a scaled positive semidefinite matrix on its range, and which parameters leave that range."""
    scale = np.sqrt(np.where(np.diagonal(hessian) > 0.0, np.diagonal(hessian), 1.0))
    values, vectors = np.linalg.eigh(hessian / np.outer(scale, scale))
    flat = values < 1e-12 * values[-1]
    inverse = (vectors[:, ~flat] / values[~flat]) @ vectors[:, ~flat].T / np.outer(scale, scale)
    leaves = (np.sum(vectors[:, flat] ** 2, axis=1) > 1e-6) | (np.diagonal(hessian) <= 0.0)
    return inverse, leaves
