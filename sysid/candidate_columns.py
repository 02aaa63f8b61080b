"""The columns that what could be missing would add to a model's rows, at the shape values that are
worth trying."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from . import rows as row
from .candidates import Candidate
from .deflection import Deflection
from .effect import Effect, MotionEffect, SensorEffect
from .model import Model
from .model_parameters import ROBOT
from .motion import Piece
from .tangents import tangents

_STEP = 1e-4  # of what the bounds of a shape value span: a difference's


def tried(view, candidate: Candidate) -> list[dict[str, float]]:
    """Sets of shape values to try: a grid over each value in turn, the others midway; where an
    effect does nothing yet, that, and what it says to try beside it."""
    if candidate.begins:
        return [dict(at) for at in candidate.begins]
    bounds = bounds_of(view.model, candidate)
    if candidate.nonlinear:
        starts = [
            s.start if s.start is not None else float(np.sqrt(low * high))
            for s, low, high, _ in bounds
        ]
        return [
            {s.name: at for (s, *_), at in zip(bounds, starts)},
            *further(view.model, candidate),
        ]
    if not candidate.effect.coefficients():
        return []
    if not bounds:
        return [{}]
    lists = {s.name: _worth(candidate.effect, s, *own) for s, *own in bounds}
    middle = {name: float(np.median(own)) for name, own in lists.items()}
    return [{**middle, name: float(at)} for name, own in lists.items() for at in own]


_MOST = 500  # values of one shape value that are tried


def _worth(effect: Effect, shape, low: float, high: float, angle: float | None) -> np.ndarray:
    """The values of a shape value that are tried: the user's, where it is given."""
    asked = effect.asked.get(shape.name)
    if asked is not None and asked.held is not None:
        return np.array([asked.held])
    own = shape.values(low, high, angle)
    return own[:: -(-len(own) // _MOST)]


def bounds_of(model: Model, candidate: Candidate) -> list[tuple]:
    """(shape, low, high, angle travelled) of a candidate's shape values."""
    return model.ranges(candidate.effect, candidate.joint)


def leading_of(model: Model, candidate: Candidate) -> tuple[str, str]:
    """Name and unit of the number that says first how large an effect is."""
    effect, grown = candidate.effect, model.with_effect(candidate.effect, (candidate.joint,))
    if not candidate.nonlinear:
        return effect.coefficients()[0].name, grown.coefficients[len(model.coefficients)].unit
    values = grown.shape_values[grown.last_shapes]
    first = next(v for v in values if v.shape.start is not None)
    return first.shape.name, first.unit


def further(model: Model, candidate: Candidate) -> list[dict[str, float]]:
    """Sets of shape values to try beyond an effect's start, at which its torque is no multiple of
    its slope there."""
    if not isinstance(candidate.effect, Deflection):
        return []
    return candidate.effect.tries(
        {s.name: (low, high) for s, low, high, _ in bounds_of(model, candidate)}
    )


def at_start(candidate: Candidate, shapes: dict[str, float]) -> bool:
    """Whether an effect does nothing at shape values."""
    return all(shapes[s.name] == s.start for s in candidate.effect.shapes() if s.start is not None)


def stepped(
    model: Model, candidate: Candidate, shapes: dict[str, float], steps
) -> dict[str, float]:
    """Shape values of an effect without columns, moved by `steps` of those by which it does something,
    within their bounds."""
    bounds = bounds_of(model, candidate)
    free = [(shape.name, low, high) for shape, low, high, _ in bounds if shape.start is not None]
    moved = {
        name: float(np.clip(shapes[name] + step, low, high))
        for (name, low, high), step in zip(free, steps)
    }
    return {**shapes, **moved}


def signs_allow(candidate: Candidate, coefficients) -> bool:
    """Whether coefficients (k0,) have the signs that an effect allows."""
    effect = candidate.effect
    if candidate.nonlinear:
        free = [s for s in effect.shapes() if s.start is not None]
        return all(not (s.low == 0.0 and c < 0) for s, c in zip(free, coefficients))
    signs = list(zip(effect.coefficients(), coefficients))
    return len(signs) > 1 or all(one.lower != 0 or c >= 0 for one, c in signs)


def grown(source, candidate: Candidate, shapes: dict[str, float]) -> Model:
    """A source's model with a candidate at shape values, in the place of what it has of the same
    effect on that joint."""
    model = source.referenced if candidate.effect.uses_load else source.model
    model = model.without(*candidate.key).with_effect(candidate.effect, (candidate.joint,))
    own = model.last_shapes
    asked = [
        shapes.get(v.shape.name, at) for v, at in zip(model.shape_values[own], model.shapes[own])
    ]
    return model.with_shapes([*model.shapes[: own.start], *asked])


def columns_of(
    source, candidate: Candidate, shapes: list[dict[str, float]], among: Sequence[int] = ()
) -> np.ndarray:
    """Columns (shapes, joints, n, k) that a candidate would add to a source's rows, its own joint's
    or every joint's.

    Of an effect that is no column, the slopes of the predicted torque in its values; away from its
    start the change of the torque as a share of its first value. In memory samples come last.

    Args:
        among: joints that will be asked alike: what is integrated step by step is for all at once.
    """
    if isinstance(candidate.effect, SensorEffect):
        return _stacked([_sensed(source, candidate, own)[None] for own in shapes])
    if candidate.swings:
        return _stacked(_changes(source, candidate, shapes, among))
    if candidate.nonlinear:
        return _stacked([_moved(source, candidate, own) for own in shapes])
    asked = (source.model, source.motion, source.pieces, candidate.effect, candidate.joint, shapes)
    return row.signatures_where_finite(*asked, source.stride, source.use)


def _stacked(found: Sequence[np.ndarray]) -> np.ndarray:
    """(sets, joints, n, k), samples last in memory, of sets (joints, n, k)."""
    return np.swapaxes(np.stack([np.swapaxes(values, 1, 2) for values in found]), 2, 3)


def _changes(source, candidate: Candidate, shapes: list[dict[str, float]], among) -> list:
    """Of each set (dof, n, 1); where the link does not stand apart yet, of its first step."""
    effect = candidate.effect
    leading = next(s.name for s in effect.shapes() if s.start is not None)
    begun = [_begun(source, candidate, leading, own) for own in shapes]
    among = {candidate.joint, *(j for j in among if j >= 0)}
    known, apart = source.bent(candidate.joint, among), None
    everywhere = tried(source, candidate) if effect.blows and not candidate.begins else []
    key = candidate.name, candidate.options
    flown_before = shapes == everywhere or source.flew(key, candidate.joint)
    if everywhere and flown_before and all(own in everywhere for own in shapes):
        tries = {}
        for joint in among:
            one = replace(candidate, joint=joint)
            tries[joint] = [_begun(source, one, leading, own) for own in tried(source, one)]
        places = [everywhere.index(own) for own in shapes]
        flown = source.flights(key, effect, tries)[candidate.joint]
        apart = [[piece[k] for k in places] for piece in flown]
    found = row.secants(
        source.model, source.motion, known, effect, begun, source.stride, source.use, apart
    )
    return [change[:, :, None] / own[leading] for change, own in zip(found, begun)]


def _begun(source, candidate: Candidate, leading: str, shapes: dict[str, float]):
    """Shape values at which an effect does something: those at which it does nothing yet with a
    small step of its first one."""
    if not at_start(candidate, shapes):
        return shapes
    low, high = next(
        (low, high) for s, low, high, _ in bounds_of(source.model, candidate) if s.name == leading
    )
    return {**shapes, leading: shapes[leading] + _STEP * (high - low)}


def _moved(source, candidate: Candidate, shapes: dict[str, float]) -> np.ndarray:
    """Of each value (dof, n, k)."""
    found = _by_shift(source, candidate, shapes)
    return _slopes(source, candidate, shapes) if found is None else found


def _by_shift(source, candidate: Candidate, shapes: dict[str, float]) -> np.ndarray | None:
    """Slopes (dof, n, k) of an effect that moves one joint and does not yet, by what such a move
    changes whatever makes it; None of all others."""
    joint, effect, out = candidate.joint, candidate.effect, []
    if joint == ROBOT or not isinstance(effect, MotionEffect) or not at_start(candidate, shapes):
        return None
    for shape, low, high, _ in bounds_of(source.model, candidate):
        if shape.start is None:
            continue  # it only says how the effect does what it does not yet
        step = _STEP * (high - low)
        step = step if shapes[shape.name] + step <= high else -step
        at, changes = {**shapes, shape.name: shapes[shape.name] + step}, []
        parts = zip(source.motion.pieces, source.bent(joint), source.shifted(joint))
        for piece, one, slopes in parts:
            known = (
                {"behind": effect.apart(one.load, 0.0 * one.load, one.seen, **at)}
                if isinstance(effect, Deflection)
                else {}
            )
            moved = _shift(one.seen, effect.moved(one.seen, joint, **known, **at), joint)
            if moved is None:
                return None
            ahead, behind = (own / step for own in moved)
            torque = np.einsum("on,ojn->jn", ahead, slopes)
            torque += np.einsum("on,ojn->jn", behind, one.slopes)
            changes += list(row.sensed(source.model, piece, torque[None]))
        out.append(row.low_passed(source.motion, changes, source.stride) * source.use.T)
    return np.stack(out, axis=2) if out else None


def _shift(was: Piece, moved: Piece, joint: int) -> tuple[np.ndarray, np.ndarray] | None:
    """How far (3, n) a joint, and its link behind it, moved; None where more than these did."""
    others, none = np.arange(moved.q.shape[1]) != joint, np.zeros((3, *moved.q.shape))
    ahead = np.stack([getattr(moved, name) - getattr(was, name) for name in ("q", "qd", "qdd")])
    parts = (none if part.deflection is None else part.deflection for part in (moved, was))
    behind = np.subtract(*parts)
    if moved.gravity is not was.gravity or ahead[:, :, others].any() or behind[:, :, others].any():
        return None
    return ahead[:, :, joint], behind[:, :, joint]


def _slopes(source, candidate: Candidate, shapes: dict[str, float]) -> np.ndarray:
    model = grown(source, candidate, shapes)
    own = model.last_shapes
    idle_yet = at_start(candidate, shapes)
    # where an effect does nothing yet, a value that only says how it does it changes nothing
    idle = [
        *model.shape_values[: own.start],
        *(v for v in model.shape_values[own] if idle_yet and v.shape.start is None),
    ]
    held = tuple(((v.term, v.joint, v.shape.name), 0.0) for v in idle)
    held_model = replace(model, held=(*model.held, *held))
    slopes = tangents(
        held_model,
        source.motion,
        source.x,
        source.stride,
        source.use,
        source.predicted if idle_yet else None,
    )[:, :, own]
    values = enumerate(model.shape_values[own])
    free = [k for k, v in values if not (idle_yet and v.shape.start is None)]
    return slopes[:, :, free]


def _sensed(source, candidate: Candidate, shapes: dict[str, float]) -> np.ndarray:
    """Slopes (n, k) of a sensor effect: what it makes of the predicted torque of its joint, by
    differences."""
    out = []
    for piece, torque, kept in zip(
        source.motion.pieces, source.unfiltered, row.starts(source.motion, source.stride)
    ):
        base, own = torque[None, candidate.joint], []
        for shape, low, high, _ in bounds_of(source.model, candidate):
            step = _STEP * (high - low)
            read = [
                candidate.effect.sensed(
                    base, piece.step, **{**shapes, shape.name: shapes[shape.name] + h}
                )
                for h in (0.0, step)
            ]
            slope = (read[1] - read[0])[0] / step
            own.append(piece.settled(slope, kept, candidate.joint))
        out.append(np.stack(own, axis=1))
    return np.concatenate(out) * source.use[:, [candidate.joint]]
