"""How far a body is from its prior: the term d(pi || prior) of eq. 14.

Each class gives value, gradient and Hessian in the inertial parameters, with leading axes for bodies.
All are zero at the prior.

Source: Lee, Wensing & Park 2020, "Geometric robot dynamic identification".
"""

from abc import ABC, abstractmethod

import numpy as np

from .pseudo import PSEUDO_BASIS, to_pseudo

_ROWS = PSEUDO_BASIS.reshape(10, 16)


def pseudo_gradient(matrix) -> np.ndarray:
    """Gradient (..., 10) in pi of <matrix, J(pi)> for symmetric matrices (..., 4, 4)."""
    return matrix.reshape(matrix.shape[:-2] + (16,)) @ _ROWS.T


def affine_metric(inverse) -> np.ndarray:
    """tr(J^-1 E_i J^-1 E_j) (..., 10, 10): the affine-invariant metric on bodies, from J^-1 (..., 4, 4)."""
    turned = inverse[..., None, :, :] @ PSEUDO_BASIS
    flat = turned.shape[:-2] + (16,)
    return turned.reshape(flat) @ np.swapaxes(np.swapaxes(turned, -1, -2).reshape(flat), -1, -2)


def _inverse(pseudo) -> np.ndarray:
    """Inverses of pseudo-inertias (..., 4, 4); of one that rounding has left at the edge of the possible ones that of its nearest inside."""
    try:
        inverse = np.linalg.inv(pseudo)
        if np.all(np.diagonal(inverse, axis1=-2, axis2=-1) > 0.0):
            return inverse
    except np.linalg.LinAlgError:
        pass
    # at the edge, or a rounding beyond it, where an inverse would point outwards
    values, vectors = np.linalg.eigh(pseudo)
    inside = np.maximum(values, np.finfo(float).eps * values[..., -1:])
    return (vectors / inside[..., None, :]) @ np.swapaxes(vectors, -1, -2)


class Divergence(ABC):
    """d(pi || prior) for bodies pi (..., 10); prior (..., 10) must be physically possible."""

    name: str
    #: True where d/gamma is a self-concordant barrier of the possible bodies
    barrier = False
    #: True where a body's change counts as a share of the prior body
    relative = True
    #: (bodies,) by which each body's counts, or one for all
    scale: float | np.ndarray = 1.0

    def __init__(self, prior):
        self.prior = np.array(prior, dtype=float)
        self.prior.setflags(write=False)

    @abstractmethod
    def value(self, pi) -> np.ndarray:
        """d (...), infinite where the body is impossible and the divergence is a barrier."""

    @abstractmethod
    def gradient(self, pi) -> np.ndarray:
        """d d / d pi (..., 10)."""

    @abstractmethod
    def hessian(self, pi) -> np.ndarray:
        """d^2 d / d pi^2 (..., 10, 10)."""


class LogDet(Divergence):
    """Bregman divergence of -log det: d = -log det(J J0^-1) + tr(J0^-1 J) - 4. No units, no frame."""

    name = "log-det"
    barrier = True

    def __init__(self, prior):
        super().__init__(prior)
        self._prior_inverse = np.linalg.inv(to_pseudo(self.prior))
        self.linear = pseudo_gradient(self._prior_inverse)
        self._log_determinant = np.linalg.slogdet(to_pseudo(self.prior))[1]

    def value(self, pi):
        pseudo = to_pseudo(pi)
        try:
            diagonal = np.diagonal(np.linalg.cholesky(pseudo), axis1=-2, axis2=-1)
            log_determinant = 2.0 * np.log(diagonal).sum(-1)
        except np.linalg.LinAlgError:
            possible = np.linalg.eigvalsh(pseudo)[..., 0] > 0.0
            log_determinant = np.where(possible, np.linalg.slogdet(pseudo)[1], -np.inf)
        return self._log_determinant - log_determinant + np.sum(self.linear * pi, -1) - 4.0

    def gradient(self, pi):
        return self.linear - pseudo_gradient(_inverse(to_pseudo(pi)))

    def hessian(self, pi):
        return affine_metric(_inverse(to_pseudo(pi)))


class _Quadratic(Divergence):
    def __init__(self, prior):
        super().__init__(prior)
        self._metric = self._constant_metric()

    @abstractmethod
    def _constant_metric(self) -> np.ndarray: ...

    def value(self, pi):
        step = pi - self.prior
        return 0.5 * np.einsum("...i,...ij,...j->...", step, self._metric, step)

    def gradient(self, pi):
        return np.einsum("...ij,...j->...i", self._metric, pi - self.prior)

    def hessian(self, pi):
        return np.broadcast_to(self._metric, np.shape(pi)[:-1] + (10, 10))


class Pullback(_Quadratic):
    """The constant pullback metric at the prior: the second-order part of log-det, 1/2 ||J0^-1/2 (J - J0) J0^-1/2||^2."""

    name = "pullback"

    def _constant_metric(self):
        return affine_metric(np.linalg.inv(to_pseudo(self.prior)))


class Euclidean(_Quadratic):
    """1/2 ||pi - prior||^2 of the ten numbers, units ignored: depends on frame and units; for comparison."""

    name = "euclidean"

    relative = False

    def _constant_metric(self):
        return np.broadcast_to(np.eye(10), self.prior.shape[:-1] + (10, 10)).copy()


class Scaled(Divergence):
    """A divergence of several bodies, each of which counts `scale` (bodies,) times."""

    def __init__(self, divergence: Divergence, scale):
        super().__init__(divergence.prior)
        self.name, self.barrier, self.relative = divergence.name, divergence.barrier, divergence.relative
        self.scale, self._own = np.asarray(scale, dtype=float), divergence
        if self.barrier:
            self.linear = divergence.linear * self.scale[:, None]

    def value(self, pi):
        return self.scale * self._own.value(pi)

    def gradient(self, pi):
        return self.scale[:, None] * self._own.gradient(pi)

    def hessian(self, pi):
        return self.scale[:, None, None] * self._own.hessian(pi)


DIVERGENCES = {kind.name: kind for kind in (LogDet, Pullback, Euclidean)}
