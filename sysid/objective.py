"""The objective of eq. 14 in the physical parameters, where it is convex.

F(x) = ||R [x; -1]||^2 + gamma sum_b d(pi_b || prior_b),   x = (pi of all bodies, coefficients of the effects),

with R the triangle that holds all the data.
"""

from dataclasses import dataclass

import numpy as np

from .inertia.divergence import Divergence


@dataclass(frozen=True)
class Objective:
    """F with its gradient and Hessian. `triangle` (size + 1, size + 1); prior weight gamma."""

    triangle: np.ndarray
    divergence: Divergence
    weight: float

    @property
    def bodies(self) -> int:
        """Number of bodies."""
        return len(self.divergence.prior)

    @property
    def barrier(self) -> bool:
        """Whether the prior keeps every body possible by itself: a log-det divergence of positive weight."""
        return self.divergence.barrier and self.weight > 0.0

    def _split(self, x):
        count = 10 * self.bodies
        return x[:count].reshape(self.bodies, 10), x[count:]

    def misfit(self, x) -> np.ndarray:
        """R [x; -1] (size + 1,)."""
        return self.triangle[:, :-1] @ x - self.triangle[:, -1]

    def value(self, x) -> float:
        """F(x) [N^2 m^2]; infinite where a log-det prior meets an impossible body."""
        misfit = self.misfit(x)
        prior = float(np.sum(self.divergence.value(self._split(x)[0]))) if self.weight else 0.0
        return float(misfit @ misfit) + self.weight * prior

    def gradient(self, x) -> np.ndarray:
        """dF/dx (size,)."""
        out = 2.0 * self.triangle[:, :-1].T @ self.misfit(x)
        if self.weight:
            out[: 10 * self.bodies] += self.weight * self.divergence.gradient(self._split(x)[0]).ravel()
        return out

    def data_hessian(self) -> np.ndarray:
        """2 R'R (size, size), the same for every x."""
        return 2.0 * self.triangle[:, :-1].T @ self.triangle[:, :-1]

    def prior_hessian(self, x) -> np.ndarray:
        """gamma times the divergence's Hessian (bodies, 10, 10)."""
        return self.weight * np.asarray(self.divergence.hessian(self._split(x)[0]))

    def hessian(self, x) -> np.ndarray:
        """d2F/dx2 (size, size)."""
        return add_blocks(self.data_hessian(), self.prior_hessian(x))


def add_blocks(matrix: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """Add (bodies, 10, 10) blocks onto the diagonal of a matrix, in place."""
    for b, block in enumerate(blocks):
        own = slice(10 * b, 10 * b + 10)
        matrix[own, own] += block
    return matrix
