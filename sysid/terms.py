"""Which effects a model has, in order: its parameters by name, and the models that stand beside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from . import regressor
from .deflection import Deflection
from .effect import Effect, SensorEffect, TorqueEffect, WrenchEffect
from .effect_parameters import Shape
from .errors import SysidError
from .inertia import PARAMETERS, UNITS
from .model_parameters import ROBOT, Coefficient, ShapeValue, holds, place
from .motion import Motion, Piece
from .robot import Robot
from .scales import Scales, scales


@dataclass(frozen=True)
class Terms:
    """A robot and the effects on its joints, in order. Immutable.

    terms: (effect, joints that have it) in order; joints (-1,) for an effect of the whole robot.
    shapes: the values that the columns are not linear in, in the order of `shape_values`.
    held: {(term, joint, name): value} of shape values that the user gave.
    reference: (bodies, 10) of the bodies whose torque is the `load` that some effects look at; referred {coefficient: value}
        with which effects need torque as well, None where these are not known.
    """

    robot: Robot
    terms: tuple[tuple[Effect, tuple[int, ...]], ...]
    shapes: tuple[float, ...] = ()
    held: tuple[tuple[tuple[int, int, str], float], ...] = ()
    reference: np.ndarray | None = None
    scales: Scales | None = None
    referred: Mapping[str, float] | None = None

    @property
    def bodies(self) -> int:
        """Number of bodies; their parameters are the first 10 times as many."""
        return len(self.robot.bodies)

    @cached_property
    def coefficients(self) -> tuple[Coefficient, ...]:
        """The effects' coefficients, after the bodies: by effect, then joint, then coefficient."""
        return tuple(
            Coefficient(
                effect.name, joint, self._name(effect, joint, linear.name), self._unit(effect, linear.unit, joint), linear.lower == 0,
                effect.given_coefficients.get(linear.name), term, None if effect.group is None else (effect.group, effect.level),
                linear.of_body,
            )
            for term, (effect, joints) in enumerate(self.terms)
            for joint in joints
            for linear in effect.coefficients()
        )

    @cached_property
    def shape_values(self) -> tuple[ShapeValue, ...]:
        """What the columns are not linear in: by effect, then joint, then value."""
        given = dict(self.held)
        out = []
        for term, (effect, joints) in enumerate(self.terms):
            for joint in joints:
                for shape, low, high, _ in self.ranges(effect, joint):
                    name, unit = self._name(effect, joint, shape.name), self._unit(effect, shape.unit, joint)
                    begin = effect.asked[shape.name].start if shape.name in effect.asked else None
                    out.append(ShapeValue(term, joint, shape, name, unit, low, high, (term, joint, shape.name) in given, begin))
        return tuple(out)

    def ranges(self, effect: Effect, joint: int) -> list[tuple[Shape, float, float, float | None]]:
        """(shape, low, high, angle that the joint travels) of an effect's shape values on a joint of this motion."""
        if self.scales is None:
            return [(s, *_within(s, effect, s.bounds(1.0)), None) for s in effect.shapes()]
        key = (id(effect), joint)
        if key not in self.scales.ranges:  # with the effect itself, so that no other comes to its place
            sample, angle = self.scales.sample, None if joint == ROBOT else float(self.scales.angle[joint])
            if effect.uses_load:
                sample = self._loaded(sample)
            sized = effect.sized(sample, self.scales.rows, joint)
            bounds = lambda s: (s.low, s.high) if sized is not None else s.bounds(self.scales.of(s.of, joint), angle)  # noqa: E731
            shapes = effect.shapes() if sized is None else sized
            self.scales.ranges[key] = effect, [(s, *_within(s, effect, bounds(s)), angle) for s in shapes]
        return self.scales.ranges[key][1]

    def _loaded(self, sample: Piece) -> Piece:
        """A sample of the motion with the torque that the prior's bodies need, the same for all effects."""
        robot, load = sample.kept.get("load of the prior", (None, None))
        if robot is not self.robot:
            load = regressor.torque(self.robot, self.robot.prior, sample.q, sample.qd, sample.qdd)
            sample.kept["load of the prior"] = self.robot, load
        return replace(sample, load=load)

    def _name(self, effect: Effect, joint: int, word: str) -> str:
        level = "" if effect.level is None else f"[{effect.level}]"
        return f"{effect.name}.{place(joint, self.robot.joints)}.{word}{level}"

    def _unit(self, effect: Effect, unit: str, joint: int) -> str:
        return unit if joint == ROBOT else effect.unit_on(unit, self.robot, joint)

    @property
    def last_shapes(self) -> slice:
        """Which of `shape_values`, and of `shapes`, are the last term's: none where it has none."""
        return slice(sum(value.term < len(self.terms) - 1 for value in self.shape_values), None)

    @cached_property
    def names(self) -> list[str]:
        """Names of all linear parameters: body.m … body.Ixz, then effect.joint.coefficient."""
        return [f"{body.name}.{p}" for body in self.robot.bodies for p in PARAMETERS] + [c.name for c in self.coefficients]

    @cached_property
    def units(self) -> list[str]:
        """Units of all linear parameters."""
        return list(UNITS) * self.bodies + [c.unit for c in self.coefficients]

    @cached_property
    def size(self) -> int:
        """Number of linear parameters."""
        return 10 * self.bodies + len(self.coefficients)

    def with_effect(self, effect: Effect, joints: tuple[int, ...]) -> Self:
        """The model with one more effect; its shape values start where they do nothing, or midway."""
        held = (*self.held, *holds(len(self.terms), effect, joints).items())
        grown = replace(self, terms=(*self.terms, (effect, joints)), held=held)
        return replace(grown, shapes=(*self.shapes, *initial(grown)[len(self.shapes) :]))

    def without(self, name: str, joint: int) -> Self:
        """The model without an effect on a joint, at every level where it is per group."""
        return self._kept(lambda effect, j: (effect.name, j) != (name, joint))

    @cached_property
    def unsensed(self) -> Self:
        """The model without its sensors, which have no parameters but shape values; itself where it has none."""
        kept = lambda effect, joint: not isinstance(effect, SensorEffect)  # noqa: E731
        return self._kept(kept) if any(isinstance(effect, SensorEffect) for effect, _ in self.terms) else self

    def _kept(self, wanted) -> Self:
        """The model with those of its effects and joints that are wanted."""
        kept = [(effect, tuple(j for j in joints if wanted(effect, j))) for effect, joints in self.terms]
        place = {term: k for k, term in enumerate(t for t, (_, joints) in enumerate(kept) if joints)}
        own = lambda term, j: wanted(self.terms[term][0], j)  # noqa: E731
        shapes = tuple(at for v, at in zip(self.shape_values, self.shapes) if own(v.term, v.joint))
        held = tuple(((place[term], j, word), at) for (term, j, word), at in self.held if own(term, j))
        return replace(self, terms=tuple(k for k in kept if k[1]), shapes=shapes, held=held)

    @property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """{group: its levels} of the groups that effects are per."""
        return {effect.group: effect.levels for effect, _ in self.terms if effect.group is not None}

    def at(self, levels: Mapping[str, str], x) -> tuple[Self, np.ndarray]:
        """The model of logs at one level of each group, and those of its parameters x (size,).

        Args:
            levels: {group: level} of every group that effects are per.

        Raises:
            SysidError: a group that is not there or is left out, or has no such level.
        """
        groups = self.groups
        for group, level in levels.items():
            if group not in groups:
                raise SysidError(f"no effect is per {group!r}", allowed=", ".join(groups) or "no level: every effect is in all logs")
            if level not in groups[group]:
                raise SysidError(f"{group} has no level {level!r}", allowed=", ".join(groups[group]))
        if missing := [group for group in groups if group not in levels]:
            effects = [*dict.fromkeys(effect.name for effect, _ in self.terms if effect.group == missing[0])]
            said = f"{', '.join(effects)} {'is' if len(effects) == 1 else 'are'} per {missing[0]}, and no level of it is given"
            raise SysidError(said, allowed=", ".join(groups[missing[0]]), do=f"give {missing[0]}=LEVEL")
        here = lambda effect: effect.group is None or effect.level == levels[effect.group]  # noqa: E731
        kept = [*range(10 * self.bodies), *(10 * self.bodies + k for k, c in enumerate(self.coefficients) if here(self.terms[c.term][0]))]
        own = self._kept(lambda effect, joint: here(effect))
        terms = tuple((effect if effect.group is None else effect.plain, joints) for effect, joints in own.terms)
        plain = replace(own, terms=terms)
        if self.referred:  # by names that say no level
            values = (self.referred.get(one.name, 0.0) for one in own.coefficients)
            plain = replace(plain, referred=dict(zip((one.name for one in plain.coefficients), values)))
        return plain, np.asarray(x)[kept]

    def with_shapes(self, values) -> Self:
        """The model with other shape values."""
        return replace(self, shapes=tuple(float(v) for v in values))

    def with_some_shapes(self, at: Mapping[int, float]) -> Self:
        """The model with other values of some shape values, by their numbers."""
        return self.with_shapes([at.get(k, s) for k, s in enumerate(self.shapes)])

    def with_reference(self, pi, c=None) -> Self:
        """The model with other bodies (bodies, 10) behind its `load`, and coefficients (coefficients,) of its effects, if known."""
        names = (one.name for one in self.coefficients)
        named = None if c is None else dict(zip(names, np.asarray(c, dtype=float).tolist(), strict=True))
        return replace(self, reference=np.array(pi), referred=named, _links={})

    def referring_to(self, x) -> Self:
        """The model with the load and the effects of parameters x (size,)."""
        pi, c = np.split(np.asarray(x), [10 * self.bodies])
        return self.with_reference(pi.reshape(-1, 10), c)

    def scaled_by(self, motion: Motion) -> Self:
        """The model with shape bounds as wide as this motion is; its shape values stay, within them or not."""
        return replace(self, scales=scales(motion))

    def measured_by(self, motion: Motion) -> Self:
        """The model with shape bounds as wide as this motion is, and its shape values where a search begins."""
        sized = replace(self.scaled_by(motion), shapes=())
        return sized.with_shapes(initial(sized))

    @property
    def uses_load(self) -> bool:
        """Whether an effect looks at the load."""
        return any(effect.uses_load for effect, _ in self.terms)

    @property
    def local(self) -> bool:
        """Whether each row of a log is a row of columns by itself, or with a few beside it, whatever the rest of the log says."""
        parts = (effect for effect, _ in self.terms)
        return not self.shape_values and all(isinstance(e, (TorqueEffect, WrenchEffect)) and not (e.memory or e.uses_load or e.reach) for e in parts)

    @property
    def deflects(self) -> bool:
        """Whether a link stands apart from its motor."""
        return any(isinstance(effect, Deflection) for effect, _ in self.terms)

    def shapes_of(self, term: int, joint: int) -> dict[str, float]:
        """{name: value} of the shape values of an effect on a joint."""
        return {v.shape.name: value for v, value in zip(self.shape_values, self.shapes) if (v.term, v.joint) == (term, joint)}


def _within(shape: Shape, effect: Effect, bounds: tuple[float, float]) -> tuple[float, float]:
    """The bounds of a shape value, as the user wants them; wide enough for the user's start."""
    asked = effect.asked.get(shape.name)
    if asked is None:
        return bounds
    if asked.within is not None:
        return asked.within
    return (min(bounds[0], asked.start), max(bounds[1], asked.start)) if asked.start is not None else bounds


def initial(model: Terms) -> list[float]:
    """Shape values to begin with: as given, as the model has them (within their bounds), else where they do nothing or midway."""
    given, out = dict(model.held), []
    for k, value in enumerate(model.shape_values):
        if (key := (value.term, value.joint, value.shape.name)) in given:
            out.append(float(given[key]))
            continue
        if k < len(model.shapes):
            begin = model.shapes[k]
        elif value.begin is not None:
            begin = value.begin
        elif value.shape.start is not None:
            begin = value.shape.start
        else:
            tried = value.shape.values(value.low, value.high)
            begin = float(tried[len(tried) // 2])
        out.append(float(np.clip(begin, value.low, value.high)))
    return out
