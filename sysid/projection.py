"""What the linear parameters of a model leave of a column: least squares with the prior, on rows
that stand in memory.
"""

from __future__ import annotations

import numpy as np

from . import eigen
from .objective import add_blocks

FLAT = 1e-6  # share of a column's square: what the model leaves of it beyond that is rounding
_TOLD = 1e-6  # of a direction's square: less than that the data say nothing
DATA = 0.5  # of a direction's square must stand in the data; the prior may not tell most of it
NOISE = 0.25  # of a direction's square: noise to half of its size, it says nothing about a law
_NOUGHT = 1e-200  # a column's square: what an exponential leaves far out, and no number to divide by


def prior_hessian(found) -> np.ndarray:
    """The prior's Hessian (size, size) where a model settled, zero for coefficients."""
    out = np.zeros((found.model.size, found.model.size))
    objective = found.problem.objective
    return add_blocks(out, objective.beside_data(found.x)) if objective.says else out


class Projection:
    """What the linear parameters leave of a signature: least squares with the prior, the same for
    every candidate.
    """

    def __init__(self, columns, residual, hessian, weights, positive=None):
        """columns (dof, n, size), residual (n, dof) at the optimum, hessian (size, size) of the
        prior, weights (dof,); positive: {parameter: value at the optimum} of those that must not
        fall below zero."""
        self.columns, self.residual, self.weights = columns, residual, np.asarray(weights)
        self.positive = dict(positive or {})
        self._system = sum(2.0 * w**2 * a.T @ a for w, a in zip(self.weights, columns)) + hessian
        self.inverse = inverted(self._system)
        self._inverses: dict[tuple[int, ...], np.ndarray] = {}
        # where a parameter is held at zero the objective still falls away from it: it is no
        # stationary point
        self._pull = np.zeros(len(self._system))
        for k in self.positive:
            self._pull[k] = sum(
                2.0 * w**2 * a[:, k] @ r for w, a, r in zip(self.weights, columns, residual.T)
            )

    def _rest(self, pinned: tuple[int, ...]) -> np.ndarray:
        """The inverse (size, size) where some parameters may not move, zero for these."""
        if pinned not in self._inverses:
            rest = np.setdiff1d(np.arange(len(self._system)), pinned)
            self._inverses[pinned] = np.zeros_like(self._system)
            self._inverses[pinned][np.ix_(rest, rest)] = inverted(self._system[np.ix_(rest, rest)])
        return self._inverses[pinned]

    def step(self, columns, joint: int):
        """Least squares when columns (n, k) of a joint, or (dof, n, k) of the robot, come in.

        Returns:
            their coefficients c (k,); the change (size,) of everything else; what everything else
            absorbs of them (size, k); what the objective falls by; which share (k,) of each
            column's square everything else cannot absorb.
        """
        cross, square, right = 0.0, 0.0, 0.0
        for j in range(len(self.weights)) if columns.ndim == 3 else [joint]:
            own = columns[j] if columns.ndim == 3 else columns
            w = 2.0 * self.weights[j] ** 2
            cross = cross + w * (self.columns[j].T @ own)
            square = square + w * (own.T @ own)
            right = right + w * (own.T @ self.residual[:, j])
        absorbed = self.inverse @ cross
        system = square - cross.T @ absorbed
        size = np.diagonal(square)
        visible = np.clip(np.diagonal(system), 0.0, None) / np.where(size > 0, size, 1.0)
        pinned, gone, inverse = (), np.zeros(len(self._system)), self.inverse
        for _ in range(len(self.positive) + 1):
            # the least of 1/2 d'Hd - pull'd + d'Xc + 1/2 c'Sc - right'c, with the pinned d taking
            # their parameters to zero
            base = inverse @ (self._pull + self._system @ gone)
            c = inverted(system) @ (right + cross.T @ gone - cross.T @ base)
            change = base - absorbed @ c - gone
            # friction that would help by turning negative is taken to zero, and stays there
            below = [
                k
                for k, value in self.positive.items()
                if k not in pinned and value + change[k] < -1e-9 * abs(value)
            ]
            if not below:
                break
            pinned = tuple(sorted({*pinned, *below}))
            gone[list(pinned)] = [self.positive[k] for k in pinned]
            inverse = self._rest(pinned)
            absorbed = inverse @ cross
            system = square - cross.T @ absorbed
        gain = float(c @ right + self._pull @ change) - 0.5 * float(
            c @ square @ c + 2.0 * change @ cross @ c + change @ self._system @ change
        )
        return c, change, absorbed, gain, visible


def spectrum(system: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The scale (k,) of each row of a positive semidefinite matrix, whatever its units, and the
    eigenvalues (k,), ascending, and eigenvectors (k, k) of the matrix without them: its diagonal
    is one, or zero where nothing stands.
    """
    diagonal = np.diagonal(system)
    there = diagonal > 1e-100
    scale = np.sqrt(np.where(there, diagonal, 1.0))
    kept = np.where(np.outer(there, there), system, 0.0)
    return scale, *eigen.symmetric(kept / np.outer(scale, scale))


def spanned(system: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The spectrum on the range of the matrix alone: scale (k,), values (r,), vectors (k, r)."""
    scale, values, vectors = spectrum(system)
    keep = values > max(1e-11 * values[-1], 1e-100)
    return scale, values[keep], vectors[:, keep]


def inverted(system: np.ndarray) -> np.ndarray:
    """Inverse of a positive semidefinite matrix on its range."""
    scale, values, vectors = spanned(system)
    return (vectors / values) @ vectors.T / np.outer(scale, scale)


def told(data: np.ndarray, system: np.ndarray) -> np.ndarray:
    """Directions (size, k) of parameters in which a system (size, size) is one, of those that the
    data's part of it (size, size) tells at all."""
    scale, values, vectors = spanned(system)
    free = vectors / np.sqrt(values) / scale[:, None]
    share, vectors = eigen.symmetric(free.T @ data @ free)
    return free @ vectors[:, share > _TOLD]


def of_data(share: np.ndarray, spread: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Which quantities of slopes (m, size) in parameters are told by the data rather than by what
    is beside them, (m,) bool, by the `share` (size, size) of the parameters' `spread` (size, size)
    that is of the data."""
    told, whole = (np.einsum("mk,kl,ml->m", slopes, one, slopes) for one in (share, spread))
    return told >= DATA * whole


def root(products: np.ndarray) -> np.ndarray:
    """R (k, k) with R R' = a positive semidefinite matrix, whatever the units of its rows."""
    scale, values, vectors = spectrum(products)
    return scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))


def directions(plain, whole, data, rough):
    """Orthonormal directions (k0, k) of columns that a model leaves, that the data tell and that are
    no noise, and the norm (k0,) of what is left of each column; None where there is none.

    Args:
        plain, whole: (k0, k0) squares of the columns, and of what the model leaves of them, prior
            included. data, rough: (k0, k0) the same of the data alone, and of what noise adds.
    """
    size = np.sqrt(np.clip(np.diagonal(plain), 0.0, None))
    there = np.diagonal(plain) > _NOUGHT
    if not np.all(np.isfinite(whole)) or not there.any():
        return None
    scale = np.where(there, size, 1.0)
    values, vectors = eigen.symmetric(whole / np.outer(scale, scale))
    kept = values > FLAT
    turn = vectors[:, kept] / np.sqrt(values[kept]) / scale[:, None]
    for matrix, good in ((data, lambda v: v > DATA), (rough, lambda v: v < NOISE)):
        values, vectors = eigen.symmetric(turn.T @ matrix @ turn)
        turn = turn @ vectors[:, good(values)]
        if not turn.shape[1]:
            return None
    return turn, np.sqrt(np.clip(np.diagonal(whole), 0.0, None))


def directions_of(plain, whole, data, rough) -> list:
    """`directions` of many groups of columns, of arrays (groups, k0, k0), at once."""
    diagonals = np.diagonal(plain, axis1=1, axis2=2)
    usual = np.isfinite(whole).all(axis=(1, 2)) & (diagonals > _NOUGHT).all(axis=1)
    scale = np.sqrt(np.where(usual[:, None], diagonals, 1.0))
    system = whole / (scale[:, :, None] * scale[:, None])
    values, turn = eigen.symmetric(np.where(usual[:, None, None], system, 0.0))
    usual &= values[:, 0] > FLAT
    turn = turn / np.sqrt(np.where(usual[:, None], values, 1.0))[:, None] / scale[:, :, None]
    turn = np.where(usual[:, None, None], turn, 0.0)
    for matrix, good in ((data, lambda v: v > DATA), (rough, lambda v: v < NOISE)):
        inside = np.swapaxes(turn, 1, 2) @ matrix @ turn
        values, vectors = eigen.symmetric(np.where(usual[:, None, None], inside, 0.0))
        usual &= good(values).all(axis=1)
        turn = turn @ vectors
    size = np.sqrt(np.clip(np.diagonal(whole, axis1=1, axis2=2), 0.0, None))
    # of nearly all groups every direction stays; each of the others is asked by itself
    parts = zip(usual, turn, size, plain, whole, data, rough)
    return [own[:2] if there else directions(*own[2:]) for there, *own in parts]
