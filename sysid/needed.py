"""What effects add to the torque of a motion; and the torque that a model needs of it, but for the effects that look at it: what a
sensor that clips is shown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from .effect import Effect, TorqueEffect, WrenchEffect
from .motion import Piece
from .terms import Terms


class Acting(NamedTuple):
    """An effect on one joint (-1: on the robot) with its coefficients (k,) and shape values."""

    term: int
    joint: int
    effect: Effect
    coefficients: np.ndarray
    shapes: dict[str, float]


def acting(model: Terms, c) -> Iterator[Acting]:
    """The effects of a model, one joint at a time, with its coefficients c (coefficients,)."""
    c, k = np.asarray(c), 0
    for term, (effect, joints) in enumerate(model.terms):
        size = len(effect.coefficients())
        for joint in joints:
            yield Acting(term, joint, effect, c[k : k + size], model.shapes_of(term, joint))
            k += size


def behind(model: Terms) -> list[Acting]:
    """The effects that add to what is needed, with the coefficients that the model refers to."""
    named = model.referred or {}
    c = np.array([named.get(one.name, 0.0) for one in model.coefficients])
    return [one for one in acting(model, c) if one.coefficients.any() and not one.effect.uses_needed]


def add(out: np.ndarray, effects: Iterable[Acting], part: Piece, robot) -> None:
    """Add to out (n, dof), in place, what effects that look back to no start do at rows seen as `part`."""
    for one in effects:
        if isinstance(one.effect, WrenchEffect):
            out += np.einsum("k,jkn->nj", one.coefficients, one.effect.columns(part, robot, **one.shapes))
        elif isinstance(one.effect, TorqueEffect):
            out[:, one.joint] += one.coefficients @ one.effect.columns(part, one.joint, **one.shapes)


def add_over(out: np.ndarray, effects: Iterable[Acting], piece: Piece, part: Piece, rows: slice, remembered: Mapping, robot) -> None:
    """`add` at rows of a piece that are seen as `part`, of the effects that are there in its log.

    Args:
        remembered: of effects that look back to the start of a log, by (term, joint), their columns over the whole piece.
    """
    for one in effects:
        if not one.effect.present(piece):
            continue
        if not (isinstance(one.effect, TorqueEffect) and one.effect.memory):
            add(out, [one], part, robot)
        elif (one.term, one.joint) in remembered:
            out[:, one.joint] += one.coefficients @ remembered[one.term, one.joint][:, rows]


def needed(model: Terms, piece: Piece, part: Piece, rows: slice, remembered: Mapping) -> np.ndarray:
    """Torque (n, dof) of the load and of all effects but those that look at it; arguments: see `add_over`."""
    out = part.load.copy()
    add_over(out, behind(model), piece, part, rows, remembered, model.robot)
    return out
