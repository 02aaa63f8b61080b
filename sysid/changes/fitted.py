"""The changes that a log supports, fitted together on all of it, with the deviations of leaving a
block of time out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..blocks import away, folds, jackknife, summed
from ..effect import find
from ..inertia import DIVERGENCES, PARAMETERIZATIONS, pseudo
from ..model import ROBOT, Model
from ..objective import Objective
from ..solve import Coordinates, solve
from .halves import across, least_squares

_WEAK = 1e-2  # of the noise's square: the weight of the payload's prior, a ball of a kilogram


@dataclass(frozen=True)
class Change:
    """A change that the new log supports. columns (dof, n, k) on its rows; parameters {name:
    (value, std, unit)}; removed: share of the squared residual of the held-out half that it
    removes, away: its standard errors from zero."""

    effect: str
    joint: str
    removed: float
    away: float
    parameters: dict[str, tuple[float, float, str]]


def together(
    structure: Model, tried, chosen, residual, weights, blocks
) -> tuple[tuple[Change, ...], np.ndarray]:
    """The changes fitted together on the whole log, and what they leave (n, dof)."""
    if not chosen:
        return (), residual
    columns = np.concatenate([tried[key] for key in chosen], axis=2)
    body = next((k for k, key in enumerate(chosen) if key[0] == "payload"), None)
    ends = np.cumsum([tried[key].shape[2] for key in chosen])
    own = None if body is None else slice(int(ends[body]) - 10, int(ends[body]))
    fitted = lambda kept: _possible(columns[:, kept], residual[kept], weights, own)  # noqa: E731
    c = fitted(np.ones(len(residual), dtype=bool))
    without = np.array([fitted(blocks != b) for b in range(blocks.max() + 1)])
    std = jackknife(without)
    after = residual - np.einsum("jnk,k->nj", columns, c)
    halves, out = folds(blocks.max() + 1, 2)[blocks] == 0, []
    with_all = across(tried, chosen, residual, weights, halves)
    for k, (name, joint) in enumerate(chosen):
        rest = across(
            tried, [key for key in chosen if key != (name, joint)], residual, weights, halves
        )
        own = slice(None) if joint == ROBOT else [joint]
        fall = summed(blocks, ((rest**2 - with_all**2) * weights**2)[:, own]).sum(1)
        share = float(fall.sum() / max(np.sum((rest * weights)[:, own] ** 2), 1e-300))
        span = slice(int(ends[k]) - tried[name, joint].shape[2], int(ends[k]))
        out.append(
            Change(
                name,
                "*" if joint == ROBOT else structure.robot.joints[joint],
                share,
                away(fall),
                _parameters(structure, name, joint, c[span], std[span], without[:, span]),
            )
        )
    return tuple(sorted(out, key=lambda change: -change.removed)), after


def _possible(columns, residual, weights, own: slice | None) -> np.ndarray:
    """Least squares, with a body's ten columns kept physically possible."""
    if own is None:
        return least_squares(columns, residual, weights)
    order = [
        *range(own.start, own.stop),
        *(k for k in range(columns.shape[2]) if not own.start <= k < own.stop),
    ]
    stacked = np.concatenate(
        [w * np.column_stack([a[:, order], r]) for w, a, r in zip(weights, columns, residual.T)]
    )
    triangle = np.linalg.qr(stacked, mode="r")
    ball = pseudo.sphere(1.0, np.zeros(3), 0.05)
    objective = Objective(triangle, DIVERGENCES["log-det"](ball[None]), _WEAK)
    flat = np.zeros(len(order) - 10, dtype=bool)
    coordinates = Coordinates(PARAMETERIZATIONS["log-cholesky"](), 1, flat, flat)
    start = np.concatenate([ball, least_squares(columns, residual, weights)[order[10:]]])
    found = solve(
        objective,
        coordinates,
        coordinates.theta(start),
        tolerance=1e-10,
        max_iterations=200,
        handover=0.5,
    ).x
    out = np.empty(len(order))
    out[order] = found
    return out


def _parameters(
    structure: Model, name: str, joint: int, c, std, without
) -> dict[str, tuple[float, float, str]]:
    grown = structure.with_effect(find(name).bound(structure.robot, joint), (joint,))
    listed = [
        *grown.coefficients[len(structure.coefficients) :],
        *grown.shape_values[grown.last_shapes],
    ]
    out = {p.name: (float(value), float(s), p.unit) for p, value, s in zip(listed, c, std)}
    if name == "payload":
        for axis, word in enumerate("xyz"):
            each = without[:, 1 + axis] / without[:, 0]
            out[f"payload.*.com_{word}"] = (float(c[1 + axis] / c[0]), float(jackknife(each)), "m")
    return out
