"""The changes that a log supports, fitted together on all of it, with the deviations of leaving a
block of time out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..blocks import jackknife
from ..effect import find
from ..inertia import DIVERGENCES, PARAMETERIZATIONS, pseudo
from ..model import ROBOT, Model
from ..objective import Objective
from ..solve import Coordinates, solve
from .halves import Key, Question, least_squares

_WEAK = 1e-2  # of the noise's square: the weight of the payload's prior, a ball of a kilogram


@dataclass(frozen=True)
class Change:
    """A change that the new log supports. removed: share of the squared residual of the held-out
    half that it removes, with its standard error; parameters {name: (value, std, unit)}."""

    effect: str
    joint: str
    removed: float
    removed_se: float
    parameters: dict[str, tuple[float, float, str]]


def together(model: Model, asked: Question, chosen) -> tuple[tuple[Change, ...], np.ndarray]:
    """The changes fitted together on the whole log, and what they leave (n, dof)."""
    residual, blocks = asked.residual, asked.blocks
    if not chosen:
        return (), residual
    columns = asked.stacked(chosen)
    ends = np.cumsum([asked.columns[key].shape[2] for key in chosen])
    spans = {
        key: slice(e - asked.columns[key].shape[2], e) for key, e in zip(chosen, ends.tolist())
    }
    body = spans.get(("payload", ROBOT))
    c = _possible(columns, residual, asked.weights, body)
    kept = [blocks != b for b in range(blocks.max() + 1)]
    without = [_possible(columns[:, k], residual[k], asked.weights, body) for k in kept]
    without = np.array(without)
    with_all, out = asked.across(chosen), []
    for key, own in spans.items():
        rest = asked.across([other for other in chosen if other != key])
        share, z = asked.taken(key, rest, with_all)
        error = share / z if z else np.nan
        joint = "*" if key[1] == ROBOT else model.robot.joints[key[1]]
        out.append(
            Change(key[0], joint, share, error, _parameters(model, key, c[own], without[:, own]))
        )
    left = residual - np.einsum("jnk,k->nj", columns, c)
    return tuple(sorted(out, key=lambda change: -change.removed)), left


def _possible(columns, residual, weights, own: slice | None) -> np.ndarray:
    """Least squares, with a body's ten columns kept physically possible."""
    if own is None:
        return least_squares(columns, residual, weights)
    body = list(range(own.start, own.stop))
    order = [*body, *(k for k in range(columns.shape[2]) if k not in body)]
    parts = zip(weights, columns, residual.T)
    stacked = np.concatenate([w * np.column_stack([a[:, order], r]) for w, a, r in parts])
    triangle = np.linalg.qr(stacked, mode="r")
    ball = pseudo.sphere(1.0, np.zeros(3), 0.05)
    objective = Objective(triangle, DIVERGENCES["log-det"](ball[None]), _WEAK)
    flat = np.zeros(len(order) - 10, dtype=bool)
    coordinates = Coordinates(PARAMETERIZATIONS["log-cholesky"](), 1, flat, flat)
    start = np.concatenate([ball, least_squares(columns, residual, weights)[order[10:]]])
    theta = coordinates.theta(start)
    found = solve(objective, coordinates, theta, tolerance=1e-10, max_iterations=200, handover=0.5)
    out = np.empty(len(order))
    out[order] = found.x
    return out


def _parameters(model: Model, key: Key, c, without) -> dict[str, tuple[float, float, str]]:
    name, joint = key
    grown = model.with_effect(find(name).bound(model.robot, joint), (joint,))
    own = grown.coefficients[len(model.coefficients) :]
    listed = [*own, *grown.shape_values[grown.last_shapes]]
    out = {p.name: (float(v), float(s), p.unit) for p, v, s in zip(listed, c, jackknife(without))}
    if name == "payload":
        for axis, word in enumerate("xyz"):
            each = without[:, 1 + axis] / without[:, 0]
            out[f"payload.*.com_{word}"] = (float(c[1 + axis] / c[0]), float(jackknife(each)), "m")
    return out
