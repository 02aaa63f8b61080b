"""The objective of eq. 14 in the physical parameters, where it is convex.

F(x) = ||R [x; -1]||^2 + gamma sum_b d(pi_b || prior_b),   x = (pi of all bodies, coefficients of the effects),

with R the triangle that holds all the data. A body that is known is measured: rows of R say that it is its prior.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .inertia import DIVERGENCES
from .inertia.divergence import Divergence


@dataclass(frozen=True)
class Objective:
    """F with its gradient and Hessian. `triangle` (size + 1, size + 1), rows of known bodies included; prior weight gamma.
    known: (bodies, 10, 10) the Hessian of these rows, or None."""

    triangle: np.ndarray
    divergence: Divergence
    weight: float
    known: np.ndarray | None = None

    @property
    def bodies(self) -> int:
        """Number of bodies."""
        return len(self.divergence.prior)

    @property
    def barrier(self) -> bool:
        """Whether the prior keeps every body possible by itself: a log-det divergence of positive weight."""
        return self.divergence.barrier and self.weight > 0.0

    @property
    def says(self) -> bool:
        """Whether anything but data says what the bodies are."""
        return self.weight > 0.0 or self.known is not None

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

    def beside_data(self, x) -> np.ndarray:
        """The Hessian (bodies, 10, 10) of all that no log says: the prior, and what is known."""
        return self.prior_hessian(x) + (0.0 if self.known is None else self.known)

    def hessian(self, x) -> np.ndarray:
        """d2F/dx2 (size, size)."""
        return add_blocks(self.data_hessian(), self.prior_hessian(x))


# Of the stiffest direction in which data pull a body: a known one gives way by 1e-8 of what a free one would.
STIFF = 1e8


def posed(triangle: np.ndarray, divergence: Divergence, weight: float, known: Sequence[int] = ()) -> Objective:
    """The objective of data and a prior.

    Args:
        triangle: (size + 1, size + 1) of the data. known: bodies that are their prior.
    """
    if not len(known):
        return Objective(triangle, divergence, weight)
    prior = divergence.prior
    metric = np.asarray(DIVERGENCES["log-det"](prior).hessian(prior))  # in which every direction counts alike, in any frame and unit
    factors = np.linalg.cholesky(metric)
    columns = [triangle[:, 10 * b : 10 * b + 10] for b in range(len(prior))]
    stiffest = max(np.linalg.norm(np.linalg.solve(f, c.T), 2) ** 2 for f, c in zip(factors, columns))
    stiff = np.zeros_like(metric)
    rows = np.zeros((10 * len(known), triangle.shape[1]))
    for k, b in enumerate(known):
        own = np.sqrt(STIFF * max(stiffest, np.finfo(float).tiny)) * factors[b].T
        rows[10 * k : 10 * k + 10, 10 * b : 10 * b + 10], rows[10 * k : 10 * k + 10, -1] = own, own @ prior[b]
        stiff[b] = 2.0 * own.T @ own
    merged = np.linalg.qr(np.concatenate([triangle, rows]), mode="r")
    return Objective(merged, divergence, weight, stiff)


def add_blocks(matrix: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """Add (bodies, 10, 10) blocks onto the diagonal of a matrix, in place."""
    for b, block in enumerate(blocks):
        own = slice(10 * b, 10 * b + 10)
        matrix[own, own] += block
    return matrix
