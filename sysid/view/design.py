"""Everything in a settled model as weighted columns, on the motion and on what the noise of its
angles adds to it; and their sums over blocks. Frozen data; the functions stand beside it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import eigen
from .. import rows as row
from ..lowpass import calm
from ..projection import prior_hessian, told
from ..settled import Settled
from ..source import Source

_FIRST = 1e-6  # share of a direction: less is none, and what is left of it rounding


@dataclass(frozen=True)
class Design:
    """Weighted columns (dof, n, directions) of the directions of the parameters, and of the shape
    values' slopes, that data tell at all: of many bodies about half. In these directions
    columns' columns plus half of the prior's Hessian are one. The residual (n, dof) at their
    optimum, weighted; `change` (size,) of the parameters from the model's own optimum, whose
    friction may be held at zero, to this one, where it is free; `turn` (size, directions); what the
    angles' noise, once more, adds to columns and residual."""

    columns: np.ndarray
    residual: np.ndarray
    change: np.ndarray
    turn: np.ndarray
    rough_columns: np.ndarray
    rough_residual: np.ndarray


@dataclass(frozen=True)
class Sums:
    """Over blocks, the prior's behind those of time: squares (blocks + 1, k, k) of the columns,
    scores (blocks + 1, k) of columns and residual, `rough_scores` of what the angles' noise adds to
    both; over all, `rough_squares`; `freed` (blocks + 1, k, k) as the function of this name tells.
    """

    squares: np.ndarray
    scores: np.ndarray
    rough_scores: np.ndarray
    rough_squares: np.ndarray
    freed: np.ndarray


def designed(found: Settled, weights, source: Source, rough: Source, left=None) -> Design:
    """The design of a settled model.

    Args:
        weights: (dof,). rough: the source with the angles' noise once more. left: (n, dof) what the
            model leaves at its parameters, weighted, where that is not its own residual.
    """
    weighted = weights[:, None, None]
    columns = source.full(found.rows.columns) * weighted
    own, size = found.model.size, columns.shape[2]
    squares = sum(a.T @ a for a in columns)
    system = squares.copy()
    system[:own, :own] += 0.5 * prior_hessian(found)
    turn = told(squares, system)
    residual = found.rows.residual(found.x) * weights
    # what is held at zero, and what was settled to a tolerance only, takes its last step here
    slopes = np.einsum("jnk,nj->k", columns[:, :, own:], residual)
    change = np.append(-0.5 * found.problem.objective.gradient(found.x), slopes)
    if left is not None:
        change += np.einsum("jnk,nj->k", columns, left - residual)
        residual = left
    change = turn @ (turn.T @ change)
    residual = residual - np.einsum("jnk,k->nj", columns, change)
    noisy = row.stack(found.model, rough.motion, rough.stride)
    more = rough.full(noisy.columns) * weighted - columns
    x = np.append(found.x, np.zeros(size - own)) + change
    # a clock that is late shifts the measured torque as well
    left = (noisy.tau - found.rows.tau) * weights - np.einsum("jnk,k->nj", more, x)
    return Design(columns @ turn, residual, change, turn, more @ turn, left)


def instrumented(
    design: Design, use, piece, band: float, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """The residual (n, dof) where the columns without the noise of the angles, Z, tell the rest no
    more, and how far that is from the design's optimum (directions,): (Z'A + P) dx = (Z - A)'r,
    with the prior's P.

    Least squares holds A'r = 0, but noise stands in A and r alike and bends the parameters; what
    it leaves then follows the motion though nothing is missing.

    Args:
        use: (n, dof) bool. piece: (n,). band: of the motion [Hz]. step: from row to row [s].

    Source: Young 2011; Janot, Vandanjon & Gautier 2014 (instrumental variables).
    """
    a, r = design.columns, design.residual
    z = np.stack([calm(own, piece, band, step) * use[:, [j]] for j, own in enumerate(a)])
    system = np.eye(a.shape[2]) + sum(one.T @ other for one, other in zip(z - a, a))
    change = np.linalg.lstsq(system, np.einsum("jnk,nj->k", z - a, r), rcond=1e-10)[0]
    return r - np.einsum("jnk,k->nj", a, change), change


def freed(squares: np.ndarray) -> np.ndarray:
    """(blocks, k, k) R by which A_b R A_b' + 1 is (1 - H_b)^(-1/2) of each block's rows A_b, where
    H_b = A_b A_b' is what a fit takes of their noise: times it, what the fit left of noise of one
    size has this size again, with no part that another direction holds.

    Args:
        squares: (blocks, k, k) A_b' A_b.

    Source: Bell & McCaffrey 2002 (the second cluster-robust covariance).
    """
    taken, turn = eigen.symmetric(squares)
    taken = np.clip(taken, _FIRST, 1.0 - _FIRST)[:, None]
    return (turn * ((1.0 - taken) ** -0.5 - 1.0) / taken) @ np.swapaxes(turn, 1, 2)


def summed(design: Design, spans: list[slice]) -> Sums:
    """A design's sums over blocks."""
    more, columns = design.rough_columns, design.columns
    product = lambda a, r, s: sum(a[j][s].T @ r[s, j] for j in range(len(a)))  # noqa: E731
    squares = np.stack([sum(a[s].T @ a[s] for a in columns) for s in spans])
    scores = np.stack([product(columns, design.residual, s) for s in spans])
    rough = np.stack([product(more, design.rough_residual, s) for s in spans])
    # in these directions all squares are one together, and at the optimum all scores nothing
    squares = np.concatenate([squares, [np.eye(squares.shape[1]) - squares.sum(0)]])
    return Sums(
        squares,
        np.concatenate([scores, [-scores.sum(0)]]),
        np.concatenate([rough, [0.0 * scores[0]]]),
        sum(a.T @ a for a in more),
        freed(squares),
    )
