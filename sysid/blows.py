"""The shape values of an effect by which a link strikes.

With the next value it strikes at other times, so that slopes lead to the next hollow at most: many values about those that
were found are tried together, as torque's slopes in where the link stands have it. How sure they are, slopes do not say
either: the best of all that were tried is asked for again with blocks of time drawn anew.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from . import rows as row
from .deflection import Deflection
from .model import Model
from .projection import Projection, prior_hessian

# How far about what was found, by how many values, and the same of the other values: from one to the next it is as far as from end to
# end of the next stage. First all over the range: what goes downhill may stop in a hollow of a play that is next to none.
_STAGES = ((np.inf, 81, np.inf, 3), (1.3, 17, np.inf, 3), (1.08, 21, 1.5, 5), (1.008, 9, 1.1, 5))
_NEAR = 2  # stages from here on look about what was found before
_LEAST = 500.0  # times less than the most it may be: less is nothing to look about
_TOGETHER = 128  # sets whose torque is made at once
_SOLVED = 4  # of the best values, which are solved with every bound kept
_AGAIN = 3  # searches, one after the other
_BLOCKS, _DRAWS = 40, 200


def striking(model: Model) -> dict[tuple[int, int], list[int]]:
    """The free shape values of effects by which a link strikes, by term and joint."""
    out: dict[tuple[int, int], list[int]] = {}
    for k, value in enumerate(model.shape_values):
        effect = model.terms[value.term][0]
        if isinstance(effect, Deflection) and effect.blows and effect.encoder == "motor" and not value.held:
            out.setdefault((value.term, value.joint), []).append(k)
    return out


def searched(found, motion, weights, solved, descended, tolerance: float):
    """What settles lowest of what was found all about, time after time, as the bodies found with other blows have another load; and
    {(term, joint): how many sets of values were tried}.

    Args:
        descended: what is found with all shape values gone downhill. tolerance: share of the objective that is lower. Others: as of
            `struck`.
    """
    tally: dict[tuple[int, int], int] = {}
    for again in range(_AGAIN if striking(found.model) else 0):
        before = found.objective
        found, more = struck(found, motion, weights, solved, wide=not again)
        tally |= {place: count + tally.get(place, 0) for place, count in more.items()}
        found = descended(found)
        if not before - found.objective > tolerance * abs(before):
            break
    return found, tally


def struck(found, motion, weights, solved, *, wide: bool):
    """What settled, or what settles lower from other values of what strikes; and {(term, joint): how many were tried}.

    Args:
        found: a `settled.Settled`. weights: (joints,) or None. solved: a model with everything linear solved for, None where it has no
            torque. wide: whether to look all over the range of what strikes.
    """
    tally: dict[tuple[int, int], int] = {}
    for place, own in striking(found.model).items():
        known = _link(found, motion, place, own)
        for stage in _STAGES[0 if wide else _NEAR :]:
            if (sets := _sets(found.model, own, *stage)) is None:
                continue
            gains = _tried(found, motion, weights, place, own, sets, known).sum(axis=1)
            tally[place] = tally.get(place, 0) + len(sets)
            model = found.model
            for at in _highest(gains, sets):  # slopes have it nearly as it is
                moved = solved(model.with_some_shapes(dict(zip(own, sets[at]))))
                if moved is not None and moved.objective < found.objective:
                    found = moved
    return found, tally


def least_of(value) -> float:
    """The least of a value at which what strikes is worth looking about."""
    return max(value.low, value.high / _LEAST)


def _highest(gains: np.ndarray, sets: np.ndarray) -> list[int]:
    """The sets that gain most, each with another first value; none that gains nothing."""
    order = np.argsort(-gains, kind="stable")
    _, best = np.unique(sets[order, 0], return_index=True)  # of each first value
    return [int(k) for k in order[np.sort(best)][:_SOLVED] if gains[k] > 0.0]


def scatter(found, motion, weights) -> dict[int, float]:
    """How far the shape values of what strikes scatter, {number: standard deviation}, if blocks of time are drawn anew (bootstrap)."""
    out: dict[int, float] = {}
    for place, own in striking(found.model).items():
        stages = [sets for stage in _STAGES if (sets := _sets(found.model, own, *stage)) is not None]
        if not stages:
            continue
        known = _link(found, motion, place, own)
        tried = _tried(found, motion, weights, place, own, np.concatenate(stages), known)
        edges = np.linspace(0, tried.shape[1], _BLOCKS + 1).astype(int)[:-1]
        by_block = np.add.reduceat(tried, edges, axis=1)
        drawn = np.random.default_rng(0).multinomial(_BLOCKS, np.full(_BLOCKS, 1.0 / _BLOCKS), _DRAWS)
        best = np.concatenate(stages)[np.argmax(by_block @ drawn.T, axis=0)]
        spread = np.sqrt(np.mean((best - np.array(found.model.shapes)[own]) ** 2, axis=0))
        out |= dict(zip(own, spread.tolist()))
    return out


def _sets(model: Model, own: list[int], far: float, count: int, others: float, fewer: int) -> np.ndarray | None:
    """Sets (sets, own) of values about those of the model, these first; None where what strikes does next to nothing and only its
    neighbourhood is asked for."""
    lists = []
    for k in own:
        value, at = model.shape_values[k], model.shapes[k]
        first = value.shape.start is not None
        least, wide = least_of(value) if first else value.low, far if first else others
        if first and at < least and np.isfinite(far):
            return None
        low, high = (least, value.high) if wide == np.inf else (max(least, at / wide), min(value.high, at * wide))
        lists.append(np.geomspace(low, high, count if first else fewer))
    return np.array([[model.shapes[k] for k in own], *product(*lists)])


def _link(found, motion, place: tuple[int, int], own: list[int]) -> tuple:
    """The model where the link follows its motor, and what the link would change if it stood apart from it."""
    model = found.model
    starts = {k: start for k in own if (start := model.shape_values[k].shape.start) is not None}
    idle = model.with_some_shapes(starts)
    return idle, row.bent(idle, motion, found.x, [place[1]])[place[1]]


def _tried(found, motion, weights, place: tuple[int, int], own: list[int], sets: np.ndarray, link: tuple) -> np.ndarray:
    """Gains (sets, rows), whose sum over rows is what the objective falls by where values stand in the place of the first ones, which
    are the model's, everything linear solved for."""
    model, rows, (term, joint) = found.model, found.rows, place
    weights = np.ones(model.robot.dof) if weights is None else np.asarray(weights, dtype=float)
    names, held = [model.shape_values[k].shape.name for k in own], model.shapes_of(term, joint)
    asked = [{**held, **dict(zip(names, map(float, at)))} for at in sets]
    (idle, known), effect = link, model.terms[term][0]
    residual = rows.residual(found.x).T
    inverse, scale = Projection(rows.columns, residual.T, prior_hessian(found), weights).inverse, 2.0 * weights**2
    gains, here = [], None
    for some in np.array_split(np.arange(len(asked)), -(-len(asked) // _TOGETHER)):  # alike: of few each would be made by itself
        change = row.secants(idle, motion, known, effect, [asked[k] for k in some], found.stride, rows.use)
        here = change[0] if here is None else here
        change = change - here
        absorbed = np.einsum("j,jnk,tjn->tk", scale, rows.columns, change, optimize=True) @ inverse
        left = change - np.einsum("jnk,tk->tjn", rows.columns, absorbed, optimize=True)
        gains.append(np.einsum("j,tjn->tn", scale, change * (residual - 0.5 * left)))
    return np.concatenate(gains)
