"""The torque that a model needs of a motion, but for the effects that look at it: what a sensor that clips is shown."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
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


def acting(model: Terms) -> Iterator[Acting]:
    """The effects that add to what is needed, at the coefficients that the model refers to."""
    named, k = model.referred or {}, 0
    for term, (effect, joints) in enumerate(model.terms):
        size = len(effect.coefficients())
        for joint in joints:
            c = np.array([named.get(one.name, 0.0) for one in model.coefficients[k : k + size]])
            k += size
            if c.any() and not effect.uses_needed:
                yield Acting(term, joint, effect, c, model.shapes_of(term, joint))


def torque(one: Acting, part: Piece, robot) -> tuple[slice, np.ndarray]:
    """Which joints an effect acts on, and its torque (n, joints) at rows seen as `part`."""
    if isinstance(one.effect, WrenchEffect):
        return slice(None), np.einsum("k,jkn->nj", one.coefficients, one.effect.columns(part, robot, **one.shapes))
    return slice(one.joint, one.joint + 1), (one.coefficients @ one.effect.columns(part, one.joint, **one.shapes))[:, None]


def needed(model: Terms, piece: Piece, part: Piece, rows: slice, remembered: Mapping) -> np.ndarray:
    """Torque (n, dof) of the load and of all effects but those that look at it, at rows of a piece that are seen as `part`.

    Args:
        remembered: of effects that look back to the start of a log, by (term, joint), their columns over the whole piece.
    """
    out = part.load.copy()
    for one in acting(model):
        if not one.effect.present(piece):
            continue
        if isinstance(one.effect, TorqueEffect) and one.effect.memory:
            if (one.term, one.joint) in remembered:
                out[:, one.joint] += one.coefficients @ remembered[one.term, one.joint][:, rows]
            continue
        joints, values = torque(one, part, model.robot)
        out[:, joints] += values
    return out
