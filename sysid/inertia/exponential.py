"""The exponential-map parameterization (paper, IV-A): J = exp(Q), Q symmetric."""

import numpy as np

from .parameterization import Parameterization
from .pseudo import PARAMETER_BASIS, dual, from_pseudo, to_pseudo

_INDEX = ((0, 0), (1, 1), (2, 2), (3, 3), (0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
BASIS = np.zeros((10, 4, 4))
for _k, (_i, _j) in enumerate(_INDEX):
    BASIS[_k, _i, _j] = BASIS[_k, _j, _i] = 1.0

# Below this spread of eigenvalues the divided difference comes from its series, above it from the quotient;
# at 0.1 both are right to about 1e-15.
_SERIES_SPREAD = 0.1


def first_divided_difference(a, b) -> np.ndarray:
    """(e^a - e^b) / (a - b), e^a where a = b; exact to rounding for any spread."""
    half = 0.5 * (a - b)
    small = np.abs(half) < 1e-3
    safe = np.where(small, 1.0, half)
    ratio = np.where(small, 1.0 + half**2 / 6.0 + half**4 / 120.0, np.sinh(safe) / safe)
    return np.exp(0.5 * (a + b)) * ratio


def second_divided_difference(a, b, c) -> np.ndarray:
    """Second divided difference of the exponential at a, b, c, symmetric in them."""
    low, middle, high = np.moveaxis(np.sort(np.stack(np.broadcast_arrays(a, b, c), -1), axis=-1), -1, 0)
    spread = high - low
    near = spread < _SERIES_SPREAD
    quotient = (first_divided_difference(high, middle) - first_divided_difference(middle, low)) / np.where(
        near, 1.0, spread
    )
    # e^mean sum_k h_k(x - mean) / (k + 2)!, h_k the complete homogeneous polynomials, by their recursion
    mean = (low + middle + high) / 3.0
    x, y, z = low - mean, middle - mean, high - mean
    e2, e3 = x * y + y * z + z * x, x * y * z  # e1 = 0 about the mean
    h = [np.ones_like(mean), np.zeros_like(mean), -e2]
    factorial, series = 2.0, 0.5 * h[0]
    for k in range(1, 9):
        if k > 2:
            h.append(-e2 * h[k - 2] + e3 * h[k - 3])
        factorial *= k + 2
        series = series + h[k] / factorial
    return np.where(near, np.exp(mean) * series, quotient)


class Exponential(Parameterization):
    """J = exp(Q); theta holds q11, q22, q33, q44, q12, q23, q13, q14, q24, q34 of the symmetric Q."""

    name = "exponential"
    coordinates = ("q11", "q22", "q33", "q44", "q12", "q23", "q13", "q14", "q24", "q34")

    @staticmethod
    def _symmetric(theta):
        return np.einsum("...k,kab->...ab", np.asarray(theta, dtype=float), BASIS)

    def parameters(self, theta):
        values, vectors = np.linalg.eigh(self._symmetric(theta))
        return from_pseudo((vectors * np.exp(values)[..., None, :]) @ np.swapaxes(vectors, -1, -2))

    def inverse(self, pi):
        values, vectors = np.linalg.eigh(to_pseudo(pi))
        if np.any(values <= 0.0):
            raise np.linalg.LinAlgError("pseudo-inertia is not positive definite")
        logarithm = (vectors * np.log(values)[..., None, :]) @ np.swapaxes(vectors, -1, -2)
        return logarithm[..., [i for i, _ in _INDEX], [j for _, j in _INDEX]]

    def jacobian(self, theta):
        # Daleckii-Krein: d exp(Q)[A] = V (F * V'AV) V'
        values, vectors = np.linalg.eigh(self._symmetric(theta))
        divided = first_divided_difference(values[..., :, None], values[..., None, :])
        turned = np.einsum("...ai,kab,...bj->...kij", vectors, BASIS, vectors, optimize=True)
        targets = np.einsum("...ai,kab,...bj->...kij", vectors, PARAMETER_BASIS, vectors, optimize=True)
        return np.einsum("...kij,...ij,...lij->...kl", targets, divided, turned, optimize=True)

    def hessian(self, theta, gradient):
        values, vectors = np.linalg.eigh(self._symmetric(theta))
        divided = second_divided_difference(
            values[..., :, None, None], values[..., None, :, None], values[..., None, None, :]
        )
        turned = np.einsum("...ai,kab,...bj->...kij", vectors, BASIS, vectors, optimize=True)
        pull = np.swapaxes(vectors, -1, -2) @ dual(gradient) @ vectors
        weighted = divided * pull[..., :, None, :]  # f[i, j, k] G[i, k]; summed over i, k and the inner j
        half = np.einsum("...pij,...ijk,...qjk->...pq", turned, weighted, turned, optimize=True)
        return half + np.swapaxes(half, -1, -2)
