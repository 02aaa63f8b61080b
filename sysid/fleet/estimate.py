"""What one robot's logs alone say of its base parameters: least squares, no prior.

The covariance is that of white noise of each joint's own size, which many rows tell well. How much
wider correlated noise makes it, blocks of time tell, one robot's few blocks poorly; all robots'
blocks together tell it well (`inflation`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import blocks, uncertainty
from ..posed_problem import inverse
from ..triangles import Compressed

_PASSES = 3  # of weights by what the fit leaves
_OPEN = 1e-6  # of a parameter's square, each in units of its own column


@dataclass(frozen=True)
class Estimate:
    """Base parameters by one set of logs.

    values (base,), NaN where these logs do not tell one. covariance (base, base) under white noise,
    zero there. widened (base,): the variance by blocks of time over that.
    """

    values: np.ndarray
    covariance: np.ndarray
    widened: np.ndarray

    @property
    def variance(self) -> np.ndarray:
        """(base,) variances under white noise, NaN of what is not told."""
        return np.where(np.isfinite(self.values), np.diagonal(self.covariance), np.nan)


def estimate(data: Compressed) -> Estimate:
    """Least squares on compressed logs, each joint weighed by its noise."""
    size = data.size
    weights = np.ones(data.joints)
    for _ in range(_PASSES):
        factor = data.total(weights)
        hessian = 2.0 * factor[:, :-1].T @ factor[:, :-1]
        basis = uncertainty.whitening(hessian)
        values = basis @ (basis.T @ (2.0 * factor[:, :-1].T @ factor[:, -1]))
        weights = inverse(np.sqrt(data.squares(values) / np.maximum(data.rows, 1)))
    # what has a part in a direction that the logs leave open is not told
    scale = np.sqrt(np.diagonal(hessian))
    along = np.linalg.qr(basis * scale[:, None])[0]
    told = (scale > 0.0) & (1.0 - np.sum(along**2, axis=1) < _OPEN)
    scores, own, spread = uncertainty.by_block(data, values, weights, basis, np.arange(size))
    freedom = max(int(data.rows.sum()), 1) / max(int(data.rows.sum()) - basis.shape[1], 1)
    white = basis @ (spread.sum(axis=0) * freedom) @ basis.T
    wide = np.einsum("ij,jk,ik->i", basis, blocks.covariance(scores, own, spread), basis)
    white = np.where(np.outer(told, told), white, 0.0)
    variance = np.diagonal(white)
    widened = np.where(told, wide / np.where(variance > 0.0, variance, 1.0), np.nan)
    return Estimate(np.where(told, values, np.nan), white, widened)
