"""A model with its shape values found, or at parameters that are given, on the rows of one motion: the problem that they pose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import rows as row
from .model import Model, moving_coefficients
from .motion import Motion
from .multistart import Searched
from .posed_problem import Problem, pose
from .prior_weight import number, with_weight
from .reduction import triangle
from .specs import Experiment
from .triangles import Compressed, Factor


@dataclass(frozen=True)
class Settled:
    """A model with its shape values found, the linear parameters x there, and the rows that both were found on.

    searched: what was done about the shape values, where they were searched.
    """

    model: Model
    x: np.ndarray
    problem: Problem
    rows: row.Rows
    stride: int
    objective: float
    searched: tuple[Searched, ...] = ()


def condensed(model: Model, rows: row.Rows) -> Compressed:
    """Rows as triangles, one a joint."""
    factors = []
    for joint in range(model.robot.dof):
        support = model.support(joint)
        kept = rows.use[:, joint]
        own = rows.columns[joint].T[support]
        stacked = np.vstack([own if kept.all() else own[:, kept], rows.tau[kept, joint]])
        factors.append(Factor(joint, 0, support, triangle(stacked.T), int(kept.sum())))
    return Compressed(model.size, model.robot.dof, tuple(factors), len(rows.t))


def poses(lighter: Experiment, model: Model, motion: Motion, prior: np.ndarray, weights, stride: int) -> Callable[[Model], tuple]:
    """What poses a model that grows from this one: its rows, and its problem."""
    moving = moving_coefficients(model, motion)

    def posed(candidate: Model) -> tuple[row.Rows, Problem]:
        rows = row.stack(candidate, motion, stride)
        return rows, pose(lighter, candidate, condensed(candidate, rows), moving, prior, weights)

    return posed


def placed(experiment: Experiment, model: Model, motion: Motion, prior: np.ndarray, x: np.ndarray, *, weights, stride: int) -> Settled:
    """A model at parameters x (size,) and its own shape values, whether or not these are its best.

    Args:
        weights, stride: as of `settle`.
    """
    rows, problem = poses(with_weight(experiment, number(experiment) / stride), model, motion, prior, weights, stride)(model)
    return Settled(model, x, problem, rows, stride, problem.objective.value(x))
