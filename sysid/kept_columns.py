"""A model's columns at rows of a piece that are asked for again and again, as by a search for shape values.

What they were is kept with the piece, beside all that it was made of, and what of this did not change is not made again: of one
shape value of one effect, that effect's columns; of a sensor's, those of its joint, whose bodies are kept as they were before it.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import cache

import numpy as np

from . import regressor
from .effect import Effect, MotionEffect, SensorEffect, TorqueEffect, WrenchEffect
from .model_parameters import ROBOT
from .motion import Piece
from .terms import Terms

_KEPT = 2**17  # samples of a piece of which anything is kept: longer logs are gone through rarely, and their memory counts


def once(piece: Piece, key: Hashable, state, alive, make: Callable):
    """What `make` gives of a piece, made anew only where what it depends on, `state`, is another than when `key` was last asked for.

    Args:
        alive: what the key and the state name by its `id`, so that nothing else comes to its place.
    """
    known = piece.kept.get(key)
    if known is not None and known[0] == state:
        return known[1]
    made = make()
    if len(piece.t) <= _KEPT:
        piece.kept[key] = state, made, alive
    return made


def kept_columns(model, piece: Piece, rows: slice, remembered: dict) -> list[np.ndarray]:
    """`Model.columns` at rows of a piece, (support in this piece, n) of each joint; of what is kept, to be read only.

    Args:
        remembered: `model.remembered(piece)`.
    """
    wide, inner = model.widened(piece, rows)
    part = cache(lambda: model.seen_at(piece, wide, remembered))
    place = id(model.robot), id(piece.smoother), rows.start, rows.stop, rows.step
    alive = model.robot, piece.smoother, model.terms

    def asked(what, state, make):
        return once(piece, (*place, *what), state, alive, make)

    @cache
    def rigid():
        seen = part()
        how = {"gravity": seen.gravity, "deflection": seen.deflection}
        return regressor.by_joint(model.robot, seen.q, seen.qd, seen.qdd, **how)

    def settled(values, joint: int):
        return piece.settled(values, inner, joint, wide.start)

    def bodies(joint: int):
        """A number that multiplies torque does so behind a filter as well as before it."""
        moves, sensors = moving(model), _sensors(model, piece, joint)
        if all(effect.constant_gain for _, effect in sensors):
            found = asked(("bodies", joint), moves, lambda: settled(rigid()[joint], joint))
            return model.sensed(found, piece, joint)
        bare = lambda: asked(("bare bodies", joint, wide.start, wide.stop), moves, lambda: rigid()[joint])  # noqa: E731
        state = moves, sensing(model, piece, joint)
        return asked(("bodies", joint), state, lambda: settled(model.sensed(bare(), piece, joint), joint))

    def added(term: int, effect: Effect, joint: int, own: int):
        """What an effect, of a joint or of the robot (-1), adds to the columns of a joint `own`."""
        state = depends(model, term, joint), sensing(model, piece, own)
        read = lambda values: settled(model.sensed(values, piece, own), own)  # noqa: E731
        if effect.memory:
            made = lambda: remembered[term, joint][:, wide]  # noqa: E731
        elif joint == ROBOT:
            made = lambda: wrench(term)[own]  # noqa: E731
        else:
            made = lambda: effect.columns(part(), joint, **model.shapes_of(term, joint))  # noqa: E731
        return asked((id(effect), joint, own), state, lambda: read(made()))

    @cache
    def wrench(term: int):
        return model.terms[term][0].columns(part(), model.robot, **model.shapes_of(term, ROBOT))

    out = []
    for own in range(model.robot.dof):
        parts = [bodies(own)]
        for term, (effect, joints) in enumerate(model.terms):
            adds = isinstance(effect, (TorqueEffect, WrenchEffect)) and effect.present(piece)
            parts += [added(term, effect, j, own) for j in joints if adds and j in (own, ROBOT)]
        out.append(np.concatenate(parts) if len(parts) > 1 else parts[0])
    return out


def moving(model: Terms) -> tuple:
    """All that says where the links of a model are, but for the motion itself."""
    own = [(term, joint) for term, (effect, joints) in enumerate(model.terms) if isinstance(effect, MotionEffect) for joint in joints]
    return tuple(_values(model, *one) for one in own), _load(model) if any(model.terms[term][0].uses_load for term, _ in own) else None


def sensing(model: Terms, piece: Piece, joint: int) -> tuple:
    """All that says what a joint's sensor makes of its torque in a piece's log."""
    return tuple(_values(model, term, joint) for term, _ in _sensors(model, piece, joint))


def depends(model: Terms, term: int, joint: int) -> tuple:
    """All that an effect of a joint (-1: of the robot) makes of a motion depends on, but for the motion itself."""
    effect = model.terms[term][0]
    load = _load(model) if effect.uses_load else None
    others = tuple((id(other), joints) for other, joints in model.terms)
    rest = (others, model.shapes, tuple((model.referred or {}).items())) if effect.uses_needed else None
    return _values(model, term, joint), moving(model), load, rest


def stands(model: Terms, term: int, joint: int) -> tuple:
    """All that says how far a link stands behind its motor by one effect, but for the motion that was measured."""
    return _values(model, term, joint), _load(model)


def _sensors(model: Terms, piece: Piece, joint: int) -> list[tuple[int, SensorEffect]]:
    known = enumerate(model.terms)
    return [(term, effect) for term, (effect, joints) in known if isinstance(effect, SensorEffect) and joint in joints and effect.present(piece)]


def _values(model: Terms, term: int, joint: int) -> tuple:
    return (id(model.terms[term][0]), joint, *model.shapes_of(term, joint).values())


def _load(model: Terms) -> bytes | None:
    return None if model.reference is None else model.reference.tobytes()
