"""What could be missing: every effect of the vocabulary on every joint, with its variants; and the
columns that it would add."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from . import rows as row
from .deflection import Deflection
from .effect import Effect, MotionEffect, SensorEffect, WrenchEffect
from .listed_effects import found as found_effect
from .model import Model
from .model_parameters import ROBOT
from .specs import Experiment, is_own
from .vocabulary import find, vocabulary

# What every model has to begin with is added first where it lacks; then what has a law; then what
# can bend to anything.
_PLAIN = ("viscous", "coulomb", "armature", "torque_bias")


@dataclass(frozen=True)
class Candidate:
    """An effect that is not in the model, on a joint (-1: the robot), with the options of a
    variant. begins: shape values to try in place of a grid, of one that takes the place of what the
    model has of it."""

    effect: Effect
    joint: int
    options: tuple[tuple[str, object], ...]
    begins: tuple[tuple[tuple[str, float], ...], ...] = ()

    @property
    def name(self) -> str:
        """The effect's word."""
        return self.effect.name

    @property
    def key(self) -> tuple[str, int]:
        """Its word and its joint: variants share it."""
        return self.effect.name, self.joint

    @property
    def kind(self) -> tuple:
        """What it is, however many terms of the same sum it has."""
        return *self.key, *(one for one in self.options if one[0] not in self.effect.nested)

    def told(self, joints: Sequence[str]) -> str:
        """Its word, and the name of its joint where it has one."""
        return self.name if self.joint == ROBOT else f"{self.name} on {joints[self.joint]}"

    @property
    def parameters(self) -> int:
        """How many numbers it brings."""
        held = sum(asked.held is not None for asked in self.effect.asked.values())
        return len(self.effect.coefficients()) + len(self.effect.shapes()) - held

    @property
    def nonlinear(self) -> bool:
        """Whether it has no columns of its own, only slopes."""
        return isinstance(self.effect, (MotionEffect, SensorEffect))

    @property
    def by_name(self) -> bool:
        """Whether its options are those that the effect has where none is given."""
        own = type(self.effect)
        return all(getattr(own, name, None) in (None, value) for name, value in self.options)

    @property
    def blows(self) -> bool:
        """Whether what it does comes in blows, a few of which may outweigh all others."""
        return isinstance(self.effect, Deflection) and self.effect.blows

    def touches(self, dof: int) -> list[int]:
        """The joints whose torque it changes."""
        everywhere = self.joint == ROBOT or isinstance(self.effect, (MotionEffect, WrenchEffect))
        return list(range(dof)) if everywhere else [self.joint]

    @property
    def simplicity(self) -> tuple:
        """Sorts the simplest first."""
        return (self.parameters, self.name not in _PLAIN, self.name)


def candidates(model: Model, extra=()) -> list[Candidate]:
    """Every effect that a model lacks, joint by joint; `extra` effects of the user's own come with
    the vocabulary."""
    robot = model.robot
    there = {(effect.name, joint) for effect, joints in model.terms for joint in joints}
    out = []
    for effect in [*(find(name) for name in vocabulary()), *extra]:
        for joint in [ROBOT] if effect.scope == "robot" else range(robot.dof):
            if (effect.name, joint) in there:
                out += _richer(model, effect.name, joint)
                continue
            for options in effect.variants(robot, joint):
                bound = effect.given(**options).bound(robot, joint)
                out.append(Candidate(bound, joint, tuple(options.items())))
    return out


def _richer(model: Model, name: str, joint: int) -> list[Candidate]:
    """What may take the place of an effect that the model has; nothing where the user holds its
    shape values."""
    (term, effect), *_ = [
        (k, e) for k, (e, joints) in enumerate(model.terms) if e.name == name and joint in joints
    ]
    if effect.level is not None:
        return []  # it would have to be richer at every level
    values = zip(model.shape_values, model.shapes)
    own = [(v, at) for v, at in values if (v.term, v.joint) == (term, joint)]
    if any(v.held for v, _ in own):
        return []
    low = {v.shape.name: v.low for v, _ in own}
    return [
        Candidate(
            effect.given(**options).bound(model.robot, joint),
            joint,
            tuple(options.items()),
            (tuple(at.items()),),
        )
        for options, at in effect.richer(**{v.shape.name: at for v, at in own})
        if all(value >= low[name] for name, value in at.items())
    ]


def own_effects(experiment: Experiment) -> list[Effect]:
    """The user's own effects, those named as candidates and those in the model, to be asked on
    every joint."""
    specs = experiment.model.candidates + [
        s for s in experiment.model.effects if is_own(s.name) or "formula" in s.options
    ]
    found = {}
    for spec in specs:
        effect = found_effect(spec, experiment.folder, experiment.data.logged)
        found.setdefault(effect.name, effect)
    return [effect for name, effect in found.items() if name not in vocabulary()]


# ---- columns


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


def columns_of(source, candidate: Candidate, shapes: list[dict[str, float]]) -> np.ndarray:
    """Columns (shapes, joints, n, k) that a candidate would add to a source's rows, its own joint's
    or every joint's.

    Of an effect that is no column, the slopes of the predicted torque in its values; away from its
    start the change of the torque as a share of its first value.
    """
    if isinstance(candidate.effect, SensorEffect):
        return np.stack([_sensed(source, candidate, own)[None] for own in shapes])
    if candidate.nonlinear:
        apart = [
            own
            for own in shapes
            if isinstance(candidate.effect, Deflection) and not at_start(candidate, own)
        ]
        changes = iter(_changes(source, candidate, apart))
        return np.stack(
            [next(changes) if own in apart else _slopes(source, candidate, own) for own in shapes]
        )
    asked = (source.model, source.motion, source.pieces, candidate.effect, candidate.joint, shapes)
    found = row.signatures_where_finite(*asked, source.stride, source.use)
    return np.stack([values[None] if values.ndim == 2 else values for values in found])


def _changes(source, candidate: Candidate, shapes: list[dict[str, float]]) -> list[np.ndarray]:
    """Of each set (dof, n, 1)."""
    if not shapes:
        return []
    leading = next(s.name for s in candidate.effect.shapes() if s.start is not None)
    known, apart, effect = source.bent(candidate.joint), None, candidate.effect
    if effect.blows and shapes == further(source.model, candidate):
        everywhere = [replace(candidate, joint=joint) for joint in range(source.model.robot.dof)]
        tries = [further(source.model, one) for one in everywhere]
        apart = source.flights((candidate.name, candidate.options), effect, tries)[candidate.joint]
    found = row.secants(
        source.model, source.motion, known, effect, shapes, source.stride, source.use, apart
    )
    return [change[:, :, None] / own[leading] for change, own in zip(found, shapes)]


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
    slopes = row.tangents(
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
            step = 1e-4 * (high - low)
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
