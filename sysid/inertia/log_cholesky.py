"""The log-Cholesky parameterization (paper, eqs. 7, 8, 11): smooth, one to one, never singular."""

import numpy as np

from .parameterization import Parameterization
from .pseudo import PARAMETER_BASIS, dual, from_pseudo, to_pseudo

# theta = [alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3]; where each but alpha stands in U (eq. 8)
_ROW = np.array([0, 1, 2, 0, 1, 0, 0, 1, 2])
_COLUMN = np.array([0, 1, 2, 1, 2, 2, 3, 3, 3])


def upper_cholesky(matrix) -> np.ndarray:
    """U upper triangular with positive diagonal and U U' = matrix (..., n, n) (eq. 7).

    Raises numpy.linalg.LinAlgError where the matrix is not positive definite.
    """
    return np.linalg.cholesky(np.asarray(matrix)[..., ::-1, ::-1])[..., ::-1, ::-1]


class LogCholesky(Parameterization):
    """pi = f(theta) with J = U J0 U', U = e^alpha [[e^d1, s12, s13, t1], [0, e^d2, s23, t2], ...] (eqs. 8, 11).

    d stretches the reference body along x, y, z, s shears it, t [m] moves it, alpha scales its density by
    e^(2 alpha).

    The paper's eq. 9, as printed, is U' U for this U; its eqs. 7, 8, 10 and 11 say U U'. Only U U' lets t move
    the body, so that is the one built here (a test pins down both).

    Args:
        reference: parameters (10,) of the reference body, or (bodies, 10) with one for each; None for J0 = 1.
    """

    name = "log-cholesky"
    coordinates = ("alpha", "d1", "d2", "d3", "s12", "s23", "s13", "t1", "t2", "t3")

    def __init__(self, reference=None):
        self._reference = np.eye(4) if reference is None else to_pseudo(reference)
        self._reference_factor = upper_cholesky(self._reference)

    def factor(self, theta) -> np.ndarray:
        """U (..., 4, 4) of eq. 8. Complex theta pass through, for complex-step derivatives."""
        theta = np.asarray(theta)
        factor = np.zeros(theta.shape[:-1] + (4, 4), dtype=np.result_type(theta, float))
        factor[..., [0, 1, 2], [0, 1, 2]] = np.exp(theta[..., 1:4])
        factor[..., _ROW[3:], _COLUMN[3:]] = theta[..., 4:]
        factor[..., 3, 3] = 1.0
        return np.exp(theta[..., 0])[..., None, None] * factor

    def parameters(self, theta):
        factor = self.factor(theta)
        return from_pseudo(factor @ self._reference @ np.swapaxes(factor, -1, -2))

    def inverse(self, pi):
        # U = U1 U2^-1 of the two unique factors (paper, below eq. 11)
        factor = upper_cholesky(to_pseudo(pi))
        factor = np.swapaxes(
            np.linalg.solve(np.swapaxes(self._reference_factor, -1, -2), np.swapaxes(factor, -1, -2)), -1, -2
        )
        scale = factor[..., 3, 3]
        theta = factor[..., _ROW, _COLUMN] / scale[..., None]
        theta[..., :3] = np.log(theta[..., :3])
        return np.concatenate([np.log(scale)[..., None], theta], -1)

    def _directions(self, factor, theta):
        """e^alpha times the derivative of each entry of U in (8): 1 off the diagonal, e^d on it. (..., 9)."""
        weight = np.broadcast_to(np.exp(theta[..., :1]), theta.shape[:-1] + (9,)).copy()
        weight[..., :3] = factor[..., [0, 1, 2], [0, 1, 2]]
        return weight

    def jacobian(self, theta):
        theta = np.asarray(theta, dtype=float)
        factor = self.factor(theta)
        image = factor @ self._reference  # U J0
        # d pi_k = 2 <P_k U J0, dU>
        slope = 2.0 * (PARAMETER_BASIS @ image[..., None, :, :])
        gamma = np.empty(theta.shape[:-1] + (10, 10))
        gamma[..., 0] = np.sum(slope * factor[..., None, :, :], axis=(-2, -1))
        gamma[..., 1:] = slope[..., _ROW, _COLUMN] * self._directions(factor, theta)[..., None, :]
        return gamma

    def hessian(self, theta, gradient):
        theta = np.asarray(theta, dtype=float)
        factor = self.factor(theta)
        weight = self._directions(factor, theta)
        pull = dual(gradient)  # G with gradient . pi = <G, U J0 U'>
        slope = 2.0 * pull @ factor @ self._reference
        first = slope[..., _ROW, _COLUMN] * weight  # gradient in d, s, t
        out = np.empty(theta.shape[:-1] + (10, 10))
        # every entry of U carries e^alpha, so alpha differentiates pi to 2 pi
        out[..., 0, 0] = 2.0 * np.sum(slope * factor, axis=(-2, -1))
        out[..., 0, 1:] = out[..., 1:, 0] = 2.0 * first
        # 2 <G dU_j J0, dU_i> = 2 G[row_i, row_j] J0[column_i, column_j]
        inner = 2.0 * pull[..., _ROW[:, None], _ROW[None, :]] * self._reference[..., _COLUMN[:, None], _COLUMN[None, :]]
        out[..., 1:, 1:] = inner * weight[..., :, None] * weight[..., None, :]
        diagonal = np.arange(1, 4)
        out[..., diagonal, diagonal] += first[..., :3]
        return out
