"""How a model's torque answers its shape values: derivatives by differences, on the rows that a stride keeps."""

from __future__ import annotations

import numpy as np

from .effect import NotFinite, SensorEffect, TorqueEffect
from .model import Model
from .motion import Motion
from .rows import moved, predicted, signatures, starts, whole

_ROUNDED = 1e-12  # of a torque: what rounding, and the cube of a step of 1e-4, leave of a difference


def tangents(model: Model, motion: Motion, x, stride: int, use: np.ndarray, middle: np.ndarray | None = None) -> np.ndarray:
    """d torque / d shape (dof, n, shapes) at parameters x: by differences, as an effect says what it does, not its slope.

    A step is a small share of what the bounds span, towards the inside; zero for values that the user holds. Where an effect of the
    motion does nothing yet, on both sides: what is even in a value has no slope there.

    Args:
        middle: `predicted(model, motion, x, stride)`, where it is at hand.
    """
    values = model.shape_values
    out = np.zeros((model.robot.dof, len(use), len(values)))
    if not values:
        return out
    pieces = bare = None
    for k, value in enumerate(values):
        if value.held:
            continue
        step, effect = difference_step(value, model.shapes[k]), model.terms[value.term][0]
        if isinstance(effect, TorqueEffect):  # all else stays
            pieces = moved(model, motion) if pieces is None else pieces
            at = model.shapes_of(value.term, value.joint)
            asked = lambda h: signatures(model, motion, pieces, effect, value.joint, [at, {**at, value.shape.name: model.shapes[k] + h}], stride, use)  # noqa: B023, E731
            try:
                here, there = asked(step)
            except NotFinite:  # at the end of a formula's domain: the slope of the other side
                step = -step
                here, there = asked(step)
            own = [i for i, c in enumerate(model.coefficients) if (c.term, c.joint) == (value.term, value.joint)]
            out[value.joint, :, k] = (there - here) @ np.asarray(x)[10 * model.bodies :][own] / step
            continue
        if middle is None:
            middle = predicted(model, motion, x, stride)
        if (slope := model.gain_slope(k, step)) is not None:
            out[value.joint, :, k] = slope * middle[:, value.joint] * use[:, value.joint]
            continue
        if isinstance(effect, SensorEffect):  # nothing moves otherwise, and no other joint is shown otherwise
            bare = bare or _bare(model.unsensed, motion, x)
            seen = lambda other: _shown(other, motion, bare, value.joint, stride)[:, None]  # noqa: B023, E731
            here, which = seen(model), [value.joint]
        else:
            seen = lambda other: predicted(other, motion, x, stride)  # noqa: E731
            here, which = middle, slice(None)
        nudged = lambda h: seen(model.with_some_shapes({k: model.shapes[k] + h}))  # noqa: B023, E731
        both = model.shapes[k] == value.shape.start and value.low <= model.shapes[k] - step <= value.high
        change = 0.5 * (nudged(step) - nudged(-step)) if both else nudged(step) - here
        if np.abs(change).max(initial=0.0) > _ROUNDED * np.abs(middle).max(initial=0.0):
            out[which, :, k] = (change / step * use[:, which]).T
    return out


def difference_step(value, at: float) -> float:
    """The step of a difference in a shape value, away from the nearer bound."""
    if value.shape.least:
        size = 1e-4 * max(abs(at), value.shape.least)
    else:
        size = 1e-4 * (abs(at) if value.shape.start is None and at else value.high - value.low)
    return size if at + size <= value.high else -size


def _bare(model: Model, motion: Motion, x) -> list[np.ndarray]:
    """Torque (samples, dof) that parameters predict over each whole piece."""
    pi, c = np.split(np.asarray(x), [10 * model.bodies])
    return [model.torque(piece, pi.reshape(-1, 10), c) for piece in whole(motion)]


def _shown(model: Model, motion: Motion, bare: list[np.ndarray], joint: int, stride: int) -> np.ndarray:
    """Torque (n,) that a joint's sensors show of `bare` (samples, dof) of each whole piece, at the rows that a stride keeps."""
    shown = [model.sensed(own[:, joint][None], piece, joint) for own, piece in zip(bare, motion.pieces)]
    kept = zip(motion.pieces, shown, starts(motion, stride))
    return np.concatenate([piece.settled(own, rows, joint)[0] for piece, own, rows in kept])
