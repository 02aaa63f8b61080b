"""Where a search begins for the values by which a link stands apart from its motor: from where they do nothing no slope leads to
the other side of a resonance."""

from __future__ import annotations

import numpy as np

from . import rows as row
from .deflection import Deflection
from .model import Model
from .motion import Motion
from .projection import Projection, prior_hessian
from .settled import Settled


def deflections(model: Model) -> list[tuple[int, int]]:
    """The terms and joints that let a link stand apart from its motor."""
    return [(term, joint) for term, (effect, joints) in enumerate(model.terms) for joint in joints if isinstance(effect, Deflection)]


def idle(model: Model, term: int, joint: int) -> Model | None:
    """The model with a deflection at nothing, where it is left so or others move or read joints."""
    values = [(k, v) for k, v in enumerate(model.shape_values) if not v.held and v.shape.start is not None]
    own = {k: v.shape.start for k, v in values if (v.term, v.joint) == (term, joint)}
    others = any(not isinstance(model.terms[v.term][0], Deflection) for _, v in values)
    out = model.with_some_shapes(own)
    return out if others or out.shapes == model.shapes else None


def stands_apart(model: Model, term: int, joint: int) -> bool:
    """Whether a deflection does anything."""
    own = (k for k, v in enumerate(model.shape_values) if (v.term, v.joint) == (term, joint) and v.shape.start is not None)
    return any(model.shapes[k] != model.shape_values[k].shape.start for k in own)


def from_tries(found: Settled, motion: Motion, term: int, joint: int, weights) -> tuple[Model | None, int]:
    """The model with the best of the values that a deflection says to try, where it does nothing yet and none is held: on the
    other side of a resonance no step from there arrives. And how many were tried."""
    model, rows = found.model, found.rows
    effect = model.terms[term][0]
    own = {v.shape.name: k for k, v in enumerate(model.shape_values) if (v.term, v.joint) == (term, joint)}
    values = [model.shape_values[k] for k in own.values()]
    tried = effect.tries({v.shape.name: (v.low, v.high) for v in values})
    busy = any(v.held for v in values) or stands_apart(model, term, joint)
    if busy or not tried:
        return None, 0
    scale = np.ones(model.robot.dof) if weights is None else np.asarray(weights)
    projection = Projection(rows.columns, rows.residual(found.x), prior_hessian(found), scale)
    gains = []
    for change in row.secants(model, motion, row.bent(model, motion, found.x, [joint])[joint], effect, tried, found.stride, rows.use):
        c, _, _, gain, _ = projection.step(change[:, :, None], joint)
        gains.append(gain if c[0] > 0 else 0.0)
    if not max(gains) > 0:
        return None, len(tried)
    best = {own[name]: at for name, at in tried[int(np.argmax(gains))].items()}
    return model.with_some_shapes(best), len(tried)
