"""How far everything falls where a candidate comes in and all else settles anew.

Slopes say what bodies would give back where they stand. Those that were bent far to imitate what is
missing stand at the edge of the possible bodies, where the prior is stiff and says that they cannot
move: a candidate that would set them free takes nothing there, and nearly all where it has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..candidate_columns import columns_of
from ..candidates import Candidate
from ..interior import minimise
from ..nearby import from_nearby
from ..posed_problem import undetermined
from ..projection import root
from .joining import COMPARED
from .view import View

_SMALL = 1e-3  # of the torque: what a coefficient that must not be negative begins at


def falls(view: View, asked: Sequence) -> np.ndarray:
    """How far a view's objective falls (asked,) with the columns of each candidate at its shapes;
    nought where effects carry bodies, which are no columns.

    Args:
        asked: a candidate each, and its shapes.
    """
    problem, own = view.settled.problem, view.rows.columns * view.weights[:, None, None]
    if problem.carried is not None:
        return np.zeros(len(asked))
    target = (view.rows.tau * view.weights).T[:, :, None]
    full = np.concatenate([own, target], axis=2)
    products, first = sum(a.T @ a for a in full), problem.objective.value(view.settled.x)
    return np.array(
        [first - _least(view, full, products, one.candidate, one.shapes) for one in asked]
    )


def _least(view: View, full, products, candidate: Candidate, shapes: dict[str, float]) -> float:
    """The least objective with one candidate.

    Args:
        full: (dof, n, size + 1) weighted columns and torque. products: (size + 1, size + 1) of them.
    """
    problem, joints = view.settled.problem, candidate.touches(view.model.robot.dof)
    columns = columns_of(view.source, candidate, [shapes])[0]
    cross, square = 0.0, 0.0
    for j, values in zip(joints, columns):
        values = values * view.weights[j] * view.rows.use[:, [j]]
        cross, square = cross + full[j].T @ values, square + values.T @ values
    size, more = len(products) - 1, len(square)
    order = [*range(size), *range(size + 1, size + 1 + more), size]
    both = np.block([[products, cross], [cross.T, square]])[np.ix_(order, order)]
    triangle = np.linalg.qr(root(both).T, mode="r")
    signs = [] if candidate.nonlinear else candidate.effect.coefficients()
    positive = np.append(problem.coordinates.positive, np.zeros(more, dtype=bool))
    positive[len(positive) - more :][: len(signs)] = [c.lower == 0 for c in signs]
    held = np.append(problem.coordinates.held, np.zeros(more, dtype=bool))
    objective = replace(problem.objective, triangle=triangle)
    held |= undetermined(objective, view.model, ~held)
    how, nothing = (objective, positive, held), np.zeros(more)
    near = np.append(view.settled.x, nothing)
    x = from_nearby(*how, near, tolerance=COMPARED) if objective.barrier else None
    if x is None:  # no interior-point method can begin near an end
        begun = problem.coordinates.physical(problem.start)
        size = np.linalg.norm(triangle[:, -1]) / np.maximum(np.sqrt(np.diagonal(square)), 1e-300)
        begun = np.append(
            begun, np.where(positive[len(begun) - len(near) :], _SMALL * size, nothing)
        )
        x = minimise(*how, begun, tolerance=COMPARED)[0][-1]
    return objective.value(x)
