"""How far everything falls where a candidate comes in and all else settles anew.

Slopes say what bodies would give back where they stand. Those that were bent far to imitate what is
missing stand at the edge of the possible bodies, where the prior is stiff and says that they cannot
move: a candidate that would set them free takes nothing there, and nearly all where it has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .. import eigen
from ..candidate_columns import bounds_of, columns_of, grown
from ..candidates import Candidate
from ..effect import SensorEffect
from ..model import moving_coefficients
from ..posed_problem import pose_triangle
from ..prior_weight import with_weight
from ..projection import root
from ..settled import condensed
from .joining import COMPARED
from .view import View

_NOTHING = 1e-9  # of the greatest: what rounding leaves of a direction that no row tells


def falls(view: View, asked: Sequence, least: float | None = None) -> np.ndarray:
    """How far a view's objective falls (asked,) with the columns of each candidate at its shapes;
    minus infinity where it cannot fall by `least`.

    Args:
        asked: a candidate each, and its shapes. least: share of a joint's least squared residual.
    """
    loss = np.sum(view.design.residual**2, axis=0)
    enough = -np.inf if least is None else least * loss.min()
    target = view.rows.tau.T[:, :, None]
    full = np.concatenate([view.rows.columns, target], axis=2) * view.weights[:, None, None]
    own = condensed(view.model, view.rows).total(view.weights)
    norms = np.linalg.norm(own, axis=0)
    norms = np.where(norms > 0.0, norms, 1.0)
    inverse = np.linalg.pinv((own / norms).T, rcond=_NOTHING) / norms
    basis, sizes, _ = np.linalg.svd((own / norms)[:, :-1])
    known = full, own, inverse, basis[:, : np.sum(sizes > _NOTHING * sizes[0])]
    left = [_least(view, *known, one.candidate, one.shapes, enough) for one in asked]
    return view.settled.objective - np.array(left)


def _least(view: View, full, own, inverse, basis, candidate: Candidate, shapes, least) -> float:
    """The least objective with one candidate; infinity where it cannot fall by `least`: the prior
    is convex and stands above its tangent, with which all is least squares.

    Args:
        full: (dof, n, size + 1) weighted columns and torque. own, inverse, basis: their triangle,
            the inverse of its transpose on its range, and a basis of its columns' range.
    """
    joints = candidate.touches(view.model.robot.dof)
    columns, signs = columns_of(view.source, candidate, [shapes])[0], []
    if candidate.nonlinear:
        turn, signs = _bounds(view, candidate, columns.shape[2])
        columns = columns * turn
    cross, square = 0.0, 0.0
    for j, values in zip(joints, columns):
        values = values * view.weights[j] * view.rows.use[:, [j]]
        cross, square = cross + full[j].T @ values, square + values.T @ values
    size, more = len(own) - 1, len(square)
    # the same squares as the rows: all that an objective looks at
    told = inverse @ cross
    if _most(square, basis.T @ told, cross.T @ np.append(-view.settled.x, 1.0)) < least:
        return np.inf
    both = np.block([[own, told], [np.zeros((more, size + 1)), root(square - told.T @ told).T]])
    triangle = both[:, [*range(size), *range(size + 1, size + 1 + more), size]]
    model = view.model if candidate.nonlinear else grown(view.source, candidate, shapes)
    before = view.settled.problem
    experiment = with_weight(view.experiment, before.objective.weight)
    moving, rows = moving_coefficients(model, view.motion), int(view.rows.use.sum())
    problem = pose_triangle(experiment, model, triangle, rows, moving, view.prior, signs)
    if problem.carried is not None and before.carried is not None:  # the noise is the view's
        heard = replace(problem.carried, weight=before.carried.weight)
        problem = replace(problem, carried=heard)
    x = problem.from_nearby(np.append(view.settled.x, np.zeros(more)), COMPARED)
    return problem.objective.value(problem.minimum(COMPARED) if x is None else x)


def _most(square, held, score) -> float:
    """How far the objective may fall at most: by what of its slopes (k,) in a candidate's columns the
    model's own do not hold, of squares (k, k); infinity where they hold a column, as then the prior
    alone says how far."""
    scale = np.sqrt(np.maximum(np.diagonal(square), 1e-300))
    values, vectors = eigen.symmetric((square - held.T @ held) / np.outer(scale, scale))
    if np.any(values <= _NOTHING):
        return np.inf
    return float(np.sum((vectors.T @ (score / scale)) ** 2 / values))


def _bounds(view: View, candidate: Candidate, more: int) -> tuple[np.ndarray, list[bool]]:
    """Of slopes: the sign (more,) by which they may not be negative, and whether they may not."""
    sensor, turn, signs = isinstance(candidate.effect, SensorEffect), np.ones(more), [False] * more
    known = [one for one in bounds_of(view.model, candidate) if sensor or one[0].start is not None]
    for k, (shape, low, high, _) in enumerate(known[:more]):
        if shape.start is not None and (low >= shape.start or high <= shape.start):
            turn[k], signs[k] = (1.0 if low >= shape.start else -1.0), True
    return turn, signs
