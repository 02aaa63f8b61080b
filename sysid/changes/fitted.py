"""The changes that a log supports, fitted together on all of it, with the deviations of leaving a
block of time out, to first order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..blocks import jackknife, z_score
from ..carried import BALL, WEAK
from ..inertia import DIVERGENCES, PARAMETERIZATIONS
from ..inertia.pseudo import from_pseudo, to_pseudo
from ..model import Model
from ..model_parameters import place
from ..objective import Objective
from ..projection import inverted, of_data, root
from ..solve import Coordinates, solve
from ..vocabulary import find
from .halves import Key, Question, least_squares
from .hands import PAYLOAD

_ROUNDS = 3  # of what is believed of a body's size


@dataclass(frozen=True)
class Change:
    """A change that the new log supports. removed: share of the squared residual of the held-out
    half that it removes, with its standard error; parameters {name: (value, std, unit)}; options:
    of the effect, where these are not the usual ones."""

    effect: str
    joint: str
    removed: float
    removed_se: float
    parameters: dict[str, tuple[float, float, str]]
    options: dict[str, str] = field(default_factory=dict)


def together(model: Model, asked: Question, chosen) -> tuple[tuple[Change, ...], np.ndarray]:
    """The changes fitted together on the whole log, and the sums of squares (dof,) that they
    leave."""
    places = asked.places(chosen)
    if not chosen:
        return (), asked.squares(places, np.zeros(0)).sum(axis=0)
    ends = np.cumsum([asked.spans[key].stop - asked.spans[key].start for key in chosen]).tolist()
    spans = dict(zip(chosen, (slice(a, b) for a, b in zip([0, *ends], ends))))
    body = spans.get(PAYLOAD)
    whole = asked.by_block.sum(axis=0)
    c, around = possible(whole, places, body)
    data = whole[np.ix_(places, places)]
    pull, spread = whole[places, -1] - data @ c, inverted(data + around)
    spreads = spread @ data @ spread, spread
    without = np.array([_nearby(whole - b, places, c, around, pull) for b in asked.by_block])
    with_all, out = asked.across(chosen), []
    for key, own in spans.items():
        rest = asked.across([other for other in chosen if other != key])
        share = asked.share(key, rest, with_all)
        z = z_score(asked.weighted_sum(key, rest - with_all))
        error = share / z if z else np.nan
        joint = place(key[1], model.robot.joints)
        by_data = [one[own, own] for one in spreads]
        parameters = _parameters(model, key, c[own], without[:, own], *by_data)
        out.append(Change(key[0], joint, share, error, parameters))
    left = asked.squares(places, c).sum(axis=0)
    return tuple(sorted(out, key=lambda change: -change.removed)), left


def with_fewer(
    asked: Question, chosen: list[Key], fewer: Sequence[Key], least: float
) -> list[Key]:  # fmt: skip
    """Changes in which a load gives way to one of `fewer` numbers that leaves no more than a load
    that can be: what turns a link's body about its joint, an encoder's zero, takes of ten free
    numbers as much.

    Args:
        least: as of `Question.supported`, for what stands then.
    """
    if PAYLOAD not in chosen:
        return chosen
    others = [key for key in fewer if key in asked.spans and key not in chosen]
    rest = [key for key in chosen if key != PAYLOAD]
    each = [chosen, *([*rest, key] for key in others)]
    best = min(each, key=lambda keys: _left(asked, keys))
    return chosen if best is chosen else asked.standing(best, least) or chosen


def _left(asked: Question, keys: Sequence[Key]) -> float:
    """What changes leave of all squares, as joints count."""
    places, body = asked.places(keys), None
    if PAYLOAD in keys:
        first = len(asked.places(keys[: keys.index(PAYLOAD)]))
        body = slice(first, first + 10)
    c, _ = possible(asked.by_block.sum(axis=0), places, body)
    return float((asked.squares(places, c) @ asked.weights**2).sum())


def possible(products, places, own: slice | None) -> tuple[np.ndarray, np.ndarray]:
    """Least squares by products, with a body's ten columns kept physically possible; and half the
    Hessian (k, k) of what is beside the data there."""
    size = len(places)
    if own is None:
        return least_squares(products, places), np.zeros((size, size))
    body = list(range(own.start, own.stop))
    order = [*body, *(k for k in range(size) if k not in body)]
    at = [places[k] for k in order]
    triangle = np.linalg.qr(root(products[np.ix_([*at, -1], [*at, -1])]).T, mode="r")
    flat = np.zeros(size - 10, dtype=bool)
    coordinates = Coordinates(PARAMETERIZATIONS["log-cholesky"](), 1, flat, flat)
    start, ball = np.concatenate([BALL, least_squares(products, at)[10:]]), BALL
    for _ in range(_ROUNDS):
        objective = Objective(triangle, DIVERGENCES["log-det"](ball[None]), WEAK)
        theta, how = coordinates.theta(start), {"tolerance": 1e-10, "max_iterations": 200}
        found = solve(objective, coordinates, theta, handover=0.5, **how)
        # an excavator's bucket holds more than a finger, and a long link's frame is far from it
        ball, start = _like(found.x[:10]), found.x
    out, around = np.empty(size), np.zeros((size, size))
    out[order] = found.x
    around[own, own] = 0.5 * objective.prior_hessian(found.x)[0]
    return out, around


def _like(body) -> np.ndarray:
    """A ball (10,) at the link's own frame as heavy and as large as a body (10,)."""
    second = to_pseudo(body)
    return from_pseudo(np.diag([*(np.trace(second[:3, :3]) / 3.0,) * 3, second[3, 3]]))


def _nearby(products, places, c, around, pull) -> np.ndarray:
    """Where coefficients c that are best for all data go when these are a little less: a step of
    Newton's. pull: (k,) of the data, at c, against what is beside them."""
    here = products[np.ix_(places, places)]
    return c + inverted(here + around) @ (products[places, -1] - here @ c - pull)


def _parameters(model: Model, key: Key, c, without, told_by_data, spread):
    """{name: (value, std, unit)}: std is NaN where what is beside the data tells more of it than
    they do.

    Args:
        c: (k,) coefficients. without: (blocks, k) with each block left out. told_by_data: (k, k)
            the part of their `spread` (k, k) that is of the data.
    """
    name, joint = key
    grown = model.with_effect(find(name).bound(model.robot, joint), (joint,))
    own = grown.coefficients[len(model.coefficients) :]
    listed = [*own, *grown.shape_values[grown.last_shapes]]

    def told(value: float, each, slope, unit: str) -> tuple[float, float, str]:
        (known,) = of_data(told_by_data, spread, slope[None])
        known &= bool(np.any(told_by_data @ slope))  # a column of nothing has no spread
        return float(value), float(jackknife(each)) if known else np.nan, unit

    slopes = np.eye(len(c))
    each = zip(listed, c, without.T, slopes)
    out = {p.name: told(v, one, slope, p.unit) for p, v, one, slope in each}
    if name == "payload":
        for axis, word in enumerate("xyz"):
            each, at = without[:, 1 + axis] / without[:, 0], c[1 + axis] / c[0]
            slope = (slopes[1 + axis] - at * slopes[0]) / c[0]
            out[f"payload.*.com_{word}"] = told(at, each, slope, "m")
    return out
