"""What could be missing: every effect of the vocabulary on every joint, with its variants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from .deflection import Deflection
from .effect import Effect, MotionEffect, SensorEffect, WrenchEffect
from .listed_effects import found as found_effect
from .model import Model
from .model_parameters import ROBOT, place
from .plain_model import PLAIN
from .robot import Robot
from .specs import Experiment, is_own
from .vocabulary import find, vocabulary


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

    def where(self, joints: Sequence[str]) -> str:
        """The name of its joint, or `*`."""
        return place(self.joint, joints)

    def named(self, joints: Sequence[str]) -> tuple[str, str]:
        """Its word and `where` it is."""
        return self.name, self.where(joints)

    def judged_by(self, joints: Sequence[str]) -> list[str]:
        """The joints whose error it is judged by."""
        return list(joints) if self.joint == ROBOT else [joints[self.joint]]

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
        """Whether its options are those that the effect has where none is given, in all logs."""
        own, some = type(self.effect), any(isinstance(value, tuple) for _, value in self.options)
        return not some and all(getattr(own, k, None) in (None, v) for k, v in self.options)

    @property
    def swings(self) -> bool:
        """Whether by it a link stands apart from its motor, whose motion was measured."""
        return isinstance(self.effect, Deflection) and self.effect.encoder == "motor"

    @property
    def blows(self) -> bool:
        """Whether what it does comes in blows, a few of which may outweigh all others."""
        return isinstance(self.effect, Deflection) and self.effect.blows

    @property
    def late(self) -> int | None:
        """The joint whose torque it reads late, or early; None where it reads none so."""
        reads = isinstance(self.effect, SensorEffect) and not self.effect.constant_gain
        return self.joint if reads else None

    def touches(self, dof: int) -> list[int]:
        """The joints whose torque it changes."""
        everywhere = self.joint == ROBOT or isinstance(self.effect, (MotionEffect, WrenchEffect))
        return list(range(dof)) if everywhere else [self.joint]

    @property
    def simplicity(self) -> tuple:
        """Sorts the simplest first, of these what any joint has."""
        return (self.parameters, self.name not in PLAIN, self.name)


def candidates(model: Model, extra=(), logs: Sequence[str] = ()) -> list[Candidate]:
    """Every effect that a model lacks, joint by joint; `extra` effects of the user's own come with
    the vocabulary, and what may be in some of the training logs alone, of those names."""
    robot = model.robot
    there = {(effect.name, joint) for effect, joints in model.terms for joint in joints}
    out = []
    for effect in [*(find(name) for name in vocabulary()), *extra]:
        for joint in [ROBOT] if effect.scope == "robot" else range(robot.dof):
            if (effect.name, joint) in there:
                out += _richer(model, effect.name, joint)
                continue
            options = [*effect.variants(robot, joint), *effect.among(logs)]
            for own, where in product(options, effect.places(robot)):
                out.append(made(effect, joint, own | where, robot))
    return out


def together(groups, robot: Robot) -> list[Candidate]:
    """Of what was asked in single logs only, in those that have most of it together: of its first
    coefficient, which is a mass and none of a load is negative, as each log alone tells it, for two
    logs up to all but one; of what may have either sign, by what its coefficients differ in most, in
    the fewer of these and all others.

    Args:
        groups: candidates that were asked, with their `coefficients` and `sizes`.
    """
    asked: dict[tuple, dict[tuple, tuple]] = {}
    for group in groups:
        options = dict(group.candidate.options)
        if logs := options.pop("logs", None):
            own = asked.setdefault((*group.candidate.key, *options.items()), {})
            own[logs] = np.array(group.coefficients) * group.sizes, group.candidate
    out = []
    for own in asked.values():
        much = dict(zip(own, _much([amounts for amounts, _ in own.values()])))
        if not next(iter(own.values()))[1].effect.either_way:
            much = {logs: amounts[0] for logs, (amounts, _) in own.items()}
        ranked = sorted(own, key=much.__getitem__, reverse=True)
        if max(map(len, ranked)) == 1:
            _, one = own[ranked[0]]
            for count in range(2, len(ranked)):
                few = one.effect.either_way and 2 * count > len(ranked)
                logs = [log for (log,) in sorted(ranked[count:] if few else ranked[:count])]
                if len(logs) > 1:
                    options = dict(one.options) | {"logs": logs}
                    out.append(made(one.effect, one.joint, options, robot))
    return out


def _much(amounts) -> np.ndarray:
    """How much (n,) of an effect each log has, of its coefficients (n, k), each in units of what it does: along the direction in which
    they differ most."""
    away = np.array(amounts) - np.mean(amounts, axis=0)
    return away @ np.linalg.svd(away, full_matrices=False)[2][0]


def made(effect: Effect, joint: int, options: dict, robot: Robot) -> Candidate:
    """An effect on a joint with options."""
    fixed = tuple((k, tuple(v) if isinstance(v, list) else v) for k, v in options.items())
    return Candidate(effect.given(**options).bound(robot, joint), joint, fixed)


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
        replace(made(effect, joint, options, model.robot), begins=(tuple(at.items()),))
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
