"""Model = robot + effects: an ordered, named vector of parameters and the columns they multiply."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType

import numpy as np

from . import own_effects, regressor, two_masses, units
from .deflection import Deflection
from .effect import Effect, LinkEffect, MotionEffect, SensorEffect, TorqueEffect, WrenchEffect
from .effect_parameters import Asked, Shape
from .errors import ConfigError, SysidError, SysidWarning, meant
from .extent import Extent
from .formula import Formula
from .inertia import PARAMETERS, UNITS
from .motion import Motion, Piece, never_move
from .per_level import at_level
from .robot import Robot
from .specs import is_own
from .vocabulary import find

_CHUNK = 4096  # samples whose columns stand in memory at once
ROBOT = -1  # the "joint" of an effect of the whole robot, called `*`


@dataclass(frozen=True)
class Coefficient:
    """One linear coefficient of an effect on a joint (-1: on the robot). given: its value, where the user says it; term: the
    model's, -1 where it is no model's; at: the (group, level) of logs that have it, None where all do."""

    effect: str
    joint: int
    name: str
    unit: str
    positive: bool
    given: float | None = None
    term: int = -1
    at: tuple[str, str] | None = None


@dataclass(frozen=True)
class ShapeValue:
    """One value that the columns are not linear in: term, joint, what it is, its bounds here. `held`: given by the user;
    `begin`: where the user wants the search to begin."""

    term: int
    joint: int
    shape: Shape
    name: str
    unit: str
    low: float
    high: float
    held: bool = False
    begin: float | None = None


@dataclass(frozen=True)
class Scales:
    """How large a joint's motion is: top speed, greatest torque, angle travelled, each (dof,); the longest log [s].

    sample: some of its rows, then the rows after each; rows: how many it has in all. `ranges` keeps what was found of effects.
    """

    speed: np.ndarray
    torque: np.ndarray
    angle: np.ndarray
    duration: float
    sample: Piece
    rows: int
    ranges: dict = field(default_factory=dict, repr=False, compare=False)

    def of(self, word: str, joint: int) -> float:
        """What bounds that are shares of `word` are multiplied with."""
        if word == "":
            return 1.0
        value = self.angle / self.torque if word == "softness" else getattr(self, word)
        return float(value) if word == "duration" else float(value.max() if joint == ROBOT else value[joint])


def scales(motion: Motion) -> Scales:
    """The scales of a motion."""
    if (found := motion.extent) is None:
        found = Extent(motion.samples)
        for piece in motion.pieces:
            found.add(piece)
    positive = lambda x: np.where(x > 0, x, 1.0)  # noqa: E731 - of a joint that never moves nothing can be said anyway
    longest = float(max(found.duration.values()))
    return Scales(positive(found.speed), positive(found.torque), positive(found.high + found.low), longest, replace(found.sample(), rest=motion.outlines[0].rest), motion.samples)


@dataclass(frozen=True)
class Model:
    """A robot and the effects on its joints, in order. Immutable; estimates live in `Fit`.

    terms: (effect, joints that have it) in order; joints (-1,) for an effect of the whole robot.
    shapes: the values that the columns are not linear in, in the order of `shape_values`.
    held: {(term, joint, name): value} of shape values that the user gave.
    reference: (bodies, 10) of the bodies whose torque is the `load` that some effects look at.
    """

    robot: Robot
    terms: tuple[tuple[Effect, tuple[int, ...]], ...]
    shapes: tuple[float, ...] = ()
    held: tuple[tuple[tuple[int, int, str], float], ...] = ()
    reference: np.ndarray | None = None
    scales: Scales | None = None
    _links: dict = field(default_factory=dict, repr=False, compare=False)  # what no shape value changes
    _rigid: dict = field(default_factory=dict, repr=False, compare=False)  # the bodies' columns, which no torque effect changes

    @property
    def bodies(self) -> int:
        """Number of bodies; their parameters are the first 10 times as many."""
        return len(self.robot.bodies)

    @cached_property
    def coefficients(self) -> tuple[Coefficient, ...]:
        """The effects' coefficients, after the bodies: by effect, then joint, then coefficient."""
        return tuple(
            Coefficient(
                effect.name, joint, self._name(effect, joint, linear.name), self._unit(linear.unit, joint), linear.lower == 0,
                effect.given_coefficients.get(linear.name), term, None if effect.group is None else (effect.group, effect.level),
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
                    name, unit = self._name(effect, joint, shape.name), self._unit(shape.unit, joint)
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
                sample = replace(sample, load=regressor.torque(self.robot, self.robot.prior, sample.q, sample.qd, sample.qdd))
            sized = effect.sized(sample, self.scales.rows, joint)
            bounds = lambda s: (s.low, s.high) if sized is not None else s.bounds(self.scales.of(s.of, joint), angle)  # noqa: E731
            shapes = effect.shapes() if sized is None else sized
            self.scales.ranges[key] = effect, [(s, *_within(s, effect, bounds(s)), angle) for s in shapes]
        return self.scales.ranges[key][1]

    def _name(self, effect: Effect, joint: int, word: str) -> str:
        level = "" if effect.level is None else f"[{effect.level}]"
        return f"{effect.name}.{'*' if joint == ROBOT else self.robot.joints[joint]}.{word}{level}"

    def _unit(self, unit: str, joint: int) -> str:
        return units.of_joint(unit, prismatic=joint != ROBOT and bool(self.robot.prismatic[joint]))

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

    def with_effect(self, effect: Effect, joints: tuple[int, ...]) -> Model:
        """The model with one more effect; its shape values start where they do nothing, or midway."""
        held = (*self.held, *_holds(len(self.terms), effect, joints).items())
        grown = replace(self, terms=(*self.terms, (effect, joints)), held=held)
        return replace(grown, shapes=(*self.shapes, *initial(grown)[len(self.shapes) :]))

    def without(self, name: str, joint: int) -> Model:
        """The model without an effect on a joint, at every level where it is per group."""
        return self._kept(lambda effect, j: (effect.name, j) != (name, joint))

    def _kept(self, wanted) -> Model:
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

    def at(self, levels: Mapping[str, str], x) -> tuple[Model, np.ndarray]:
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
        return replace(own, terms=terms), np.asarray(x)[kept]

    def with_shapes(self, values) -> Model:
        """The model with other shape values."""
        return replace(self, shapes=tuple(float(v) for v in values))

    def with_reference(self, pi) -> Model:
        """The model with other bodies behind its `load`."""
        return replace(self, reference=np.array(pi), _links={})

    def scaled_by(self, motion: Motion) -> Model:
        """The model with shape bounds as wide as this motion is; its shape values stay, within them or not."""
        return replace(self, scales=scales(motion))

    def measured_by(self, motion: Motion) -> Model:
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

    def support(self, joint: int, piece: Piece | None = None) -> np.ndarray:
        """Indices of the parameters that can enter the torque of a joint, in a piece's log or in any, ascending."""
        robot = self.robot
        depends = np.abs(robot.transmission) > 0
        for row, parent in enumerate(robot.parents):  # parents first: a body moves with what carries it
            if parent >= 0:
                depends[row] |= depends[parent]
        bodies = [10 * b + k for b, body in enumerate(robot.bodies) if depends[body.row, joint] for k in range(10)]
        first = 10 * self.bodies
        there = {term for term, (effect, _) in enumerate(self.terms) if piece is None or effect.present(piece)}
        own = [first + k for k, c in enumerate(self.coefficients) if c.joint in (joint, ROBOT) and c.term in there]
        return np.array(bodies + own, dtype=int)

    def shapes_of(self, term: int, joint: int) -> dict[str, float]:
        """{name: value} of the shape values of an effect on a joint."""
        return {v.shape.name: value for v, value in zip(self.shape_values, self.shapes) if (v.term, v.joint) == (term, joint)}

    @property
    def gains(self) -> list[int]:
        """Which shape values multiply their joint's torque by one number in all logs, and are free."""
        effects = [self.terms[value.term][0] for value in self.shape_values]
        return [k for k, (effect, value) in enumerate(zip(effects, self.shape_values)) if isinstance(effect, SensorEffect) and effect.constant_gain and effect.level is None and not value.held]

    def gain_slope(self, k: int, step: float) -> float | None:
        """Of a shape value that multiplies its joint's torque by one number, the slope of that number's logarithm, by a difference;
        None of any other."""
        if k not in self.gains:
            return None
        value = self.shape_values[k]
        effect, at = self.terms[value.term][0], self.shapes_of(value.term, value.joint)
        here, there = effect.gain(**at), effect.gain(**{**at, value.shape.name: self.shapes[k] + step})
        return (there - here) / (step * here)

    @property
    def reach(self) -> int:
        """Samples on either side of a row that its columns look at."""
        return max([effect.reach for effect, _ in self.terms], default=0)

    def remembered(self, piece: Piece) -> dict:
        """What effects that look back to the start of a log make of a whole piece, by (term, joint): columns of those that add
        torque, how far a link stands behind its motor."""
        if not any(effect.memory for effect, _ in self.terms):
            return {}
        whole = piece.part(slice(0, len(piece.t)))
        out = {
            (term, joint): effect.apart(*self._link_side(piece, joint), whole, **self.shapes_of(term, joint))
            for term, (effect, joints) in enumerate(self.terms)
            if isinstance(effect, Deflection)
            for joint in joints
        }
        columns = [term for term, (effect, _) in enumerate(self.terms) if effect.memory and not isinstance(effect, Deflection)]
        part = self.seen(piece, out) if columns else None
        return out | {(term, joint): self.terms[term][0].columns(part, joint, **self.shapes_of(term, joint)) for term in columns for joint in self.terms[term][1]}

    def _link_side(self, piece: Piece, joint: int) -> tuple[np.ndarray, np.ndarray]:
        """Load and inertia of a joint's link over a whole piece."""
        key = (id(piece.q), joint)
        if key not in self._links:  # with the angles themselves, so that no others come to their place
            self._links[key] = (piece.q, two_masses.link_side(self.robot, self._bodies, piece, joint))
        return self._links[key][1]

    @property
    def _bodies(self) -> np.ndarray:
        return self.robot.prior if self.reference is None else self.reference

    def seen(self, piece: Piece, remembered: dict | None = None) -> Piece:
        """A whole piece as effects see it: with the load that its bodies need, and moved as the motion effects say.

        Args:
            remembered: `remembered(piece)`, where it is at hand.
        """
        known = self.remembered(piece) if remembered is None else remembered
        return self._seen(piece, slice(0, len(piece.t)), known, True)

    def _seen(self, piece: Piece, rows: slice, remembered: dict, loaded: bool = False) -> Piece:
        """Rows of a piece with the load that effects look at, and moved as the motion effects say."""
        part = piece.part(rows)
        if loaded or any(effect.uses_load and not effect.memory for effect, _ in self.terms):
            part = replace(part, load=regressor.torque(self.robot, self._bodies, part.q, part.qd, part.qdd))
        for term, (effect, joints) in enumerate(self.terms):
            if isinstance(effect, MotionEffect):
                for joint in joints:
                    known = {"behind": remembered[term, joint][:, rows]} if isinstance(effect, Deflection) else {}
                    part = effect.moved(part, joint, **known, **self.shapes_of(term, joint))
        return part

    def columns(self, piece: Piece, rows: slice, remembered: dict | None = None, *, keep: bool = False) -> list[np.ndarray]:
        """For each joint the columns (support in this piece, n) of the rows `rows` of a piece, filtered where its torque is.

        Args:
            rows: a slice, or the rows' numbers where nothing looks beside them (no filter, no `reach`).
            remembered: `remembered(piece)`, where it is at hand.
            keep: the bodies' columns for whoever asks again for these rows, of this model or of one that grew from it.
        """
        wide, inner = self._widened(piece, rows)
        if remembered is None:
            remembered = self.remembered(piece)
        part = self._seen(piece, wide, remembered)
        by_joint: list[list[np.ndarray]] = [[] for _ in self.robot.joints]
        for term, (effect, joints) in enumerate(self.terms):
            for joint in joints if effect.present(piece) else ():
                if isinstance(effect, TorqueEffect) and effect.memory:
                    by_joint[joint].append(remembered[term, joint][:, wide])
                elif isinstance(effect, TorqueEffect):
                    by_joint[joint].append(effect.columns(part, joint, **self.shapes_of(term, joint)))
                elif isinstance(effect, WrenchEffect):
                    for own, values in zip(by_joint, effect.columns(part, self.robot, **self.shapes_of(term, joint))):
                        own.append(values)
        first = wide.start if isinstance(wide, slice) else 0
        own = [piece.settled(self.sensed(np.concatenate(one), piece, joint), inner, joint, first) if one else None for joint, one in enumerate(by_joint)]
        room = [0 if one is None else len(one) for one in own]
        out = []
        for joint, (rigid, effects) in enumerate(zip(self._bodies_of(piece, rows, part, wide, inner, keep, room), own)):
            size = len(self._support_of_bodies[joint])
            if len(rigid) == size:
                rigid = rigid if effects is None else np.concatenate([rigid, effects])
            elif effects is not None:
                rigid[size:] = effects
            out.append(rigid)
        return out

    @cached_property
    def _support_of_bodies(self) -> list[np.ndarray]:
        """Of each joint, the bodies' parameters that enter its torque."""
        count = 10 * self.bodies
        return [own[own < count] for own in (self.support(joint) for joint in range(self.robot.dof))]

    def _bodies_of(self, piece: Piece, rows: slice, part: Piece, wide: slice, inner: slice, keep: bool, room: list[int]) -> list[np.ndarray]:
        """The bodies' columns (support, n) in each joint's torque at rows of a piece, seen as `part`, filtered; with `room` for as many
        more where nothing is to be done to them."""
        # with what they were made of, so that nothing else comes to its place
        key = (id(piece.q), id(piece.smoother), rows.start, rows.stop, rows.step) if isinstance(rows, slice) else None
        sensors = [effect for effect, _ in self.terms if isinstance(effect, SensorEffect)]
        moved = any(isinstance(effect, MotionEffect) for effect, _ in self.terms) or any(not effect.constant_gain for effect in sensors)
        gained = lambda out: [self.sensed(own, piece, joint) for joint, own in enumerate(out)]  # noqa: E731
        if not moved and key in self._rigid:
            return gained(self._rigid[key][2])
        plain = piece.smoother is None and not sensors and not keep and inner == slice(None)
        spare = room if plain else [0] * self.robot.dof
        inertial = regressor.by_joint(self.robot, part.q, part.qd, part.qdd, gravity=part.gravity, deflection=part.deflection, room=spare)
        if plain:
            return inertial
        first = wide.start if isinstance(wide, slice) else 0
        out = [piece.settled(self.sensed(own, piece, joint) if moved else own, inner, joint, first) for joint, own in enumerate(inertial)]
        if keep and not moved:
            self._rigid[key] = (piece.q, piece.smoother, out)
        return out if moved else gained(out)

    def torque(self, piece: Piece, pi, c, stride: int = 1) -> np.ndarray:
        """Predicted torque (samples, dof) over a piece's core, of bodies pi (bodies, 10) and coefficients c.

        Args:
            stride: predict every `stride`-th sample only.
        """
        out = np.empty((-(-piece.samples // stride), self.robot.dof))
        remembered = self.remembered(piece)
        for rows in chunks(piece, stride * max(1, (_CHUNK if piece.smoother is None else 4 * _CHUNK) // stride)):
            wide, inner = self._widened(piece, slice(rows.start, rows.stop, stride))
            part = self._seen(piece, wide, remembered)
            predicted = regressor.torque(self.robot, pi, part.q, part.qd, part.qdd, gravity=part.gravity, deflection=part.deflection).T
            k = 0
            for term, (effect, joints) in enumerate(self.terms):
                size = len(effect.coefficients())
                if not effect.present(piece):
                    k += size * len(joints)
                    continue
                for joint in joints:
                    own = np.asarray(c)[k : k + size]
                    if isinstance(effect, TorqueEffect) and effect.memory:
                        predicted[joint] += own @ remembered[term, joint][:, wide]
                    elif isinstance(effect, TorqueEffect):
                        predicted[joint] += own @ effect.columns(part, joint, **self.shapes_of(term, joint))
                    elif isinstance(effect, WrenchEffect):
                        predicted += np.einsum("k,jkn->jn", own, effect.columns(part, self.robot, **self.shapes_of(term, joint)))
                    k += size
            for joint in range(self.robot.dof):
                predicted[joint] = self.sensed(predicted[None, joint], piece, joint)[0]
            settled = np.stack([piece.settled(own, inner, joint, wide.start) for joint, own in enumerate(predicted)], axis=1)
            start = (rows.start - piece.core.start) // stride
            out[start : start + len(settled)] = settled
        return out

    def sensed(self, values: np.ndarray, piece: Piece, joint: int) -> np.ndarray:
        """What the sensor of a joint makes of torque (k, n) over rows of a piece."""
        for term, (effect, joints) in enumerate(self.terms):
            if isinstance(effect, SensorEffect) and joint in joints and effect.present(piece):
                values = effect.sensed(values, piece.step, **self.shapes_of(term, joint))
        return values

    def _widened(self, piece: Piece, rows: slice) -> tuple[slice, slice]:
        """Rows with the margin that filters and effects need for them to come out as over the whole piece, and where the
        rows stand among these."""
        margin = self.reach
        if piece.smoother is None and not margin:
            return rows, slice(None)
        if piece.smoother is not None:
            # a recursive filter forgets slowly: six times its one-per-cent reach leaves 1e-13
            margin += piece.smoother.reach * (6 if piece.smoother.kind == "butterworth" else 1)
        wide = slice(max(0, rows.start - margin), min(len(piece.t), rows.stop + margin))
        return wide, slice(rows.start - wide.start, rows.stop - wide.start, rows.step)


def _within(shape: Shape, effect: Effect, bounds: tuple[float, float]) -> tuple[float, float]:
    """The bounds of a shape value, as the user wants them; wide enough for the user's start."""
    asked = effect.asked.get(shape.name)
    if asked is None:
        return bounds
    if asked.within is not None:
        return asked.within
    return (min(bounds[0], asked.start), max(bounds[1], asked.start)) if asked.start is not None else bounds


def initial(model: Model) -> list[float]:
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


def chunks(piece: Piece, size: int) -> Iterator[slice]:
    """The rows of a piece's core in runs of at most `size`."""
    for start in range(piece.core.start, piece.core.stop, size):
        yield slice(start, min(start + size, piece.core.stop))


def build(robot: Robot, effects, folder: Path = Path(), signals=(), groups: Mapping[str, Mapping] = MappingProxyType({})) -> Model:
    """The model of an experiment's `model.effects`; files of own effects are relative to `folder`, `signals` are logged, `groups` are
    {group: {level: its logs}}.

    Raises:
        ConfigError: an effect or joint that is not there, or an effect twice on a joint, or an option it does not have, or
            an own effect that fails.
    """
    terms, seen, held = [], set(), {}
    for spec in effects:
        effect = found(spec, folder, signals)
        if effect.scope == "robot" and spec.joints is not None:
            raise ConfigError(f"model.effects: {effect.name} is an effect of the whole robot", allowed="no joints", do="leave `joints` out")
        names = ["*"] if effect.scope == "robot" else spec.joints if spec.joints is not None else list(robot.joints)
        joints = []
        for name in names:
            if effect.scope != "robot" and name not in robot.joints:
                raise ConfigError(f"model.effects: {effect.name} names the joint {name!r}", allowed=", ".join(robot.joints), do=meant(name, robot.joints, "leave the joint out for all of them"))
            if (effect.name, name) in seen:
                where = "" if name == "*" else f" on joint {name!r}"
                do = "give each a `name` of its own" if "formula" in spec.options else "leave one out"
                raise ConfigError(f"model.effects: {effect.name} stands twice{where}", do=do)
            seen.add((effect.name, name))
            joints.append(ROBOT if effect.scope == "robot" else robot.joints.index(name))
        for joint in joints:
            effect = effect.bound(robot, joint)
            if is_own(spec.name):
                own_effects.check(effect, robot, joint)
        for own in _levels(effect, spec, groups):
            held |= _holds(len(terms), own, joints)
            terms.append((own, tuple(joints)))
    made = Model(robot, tuple(terms), held=tuple(held.items()))
    return made.with_shapes(initial(made))


def _levels(effect: Effect, spec, groups: Mapping[str, Mapping]) -> list[Effect]:
    """An effect at each level of the group that it is per, but for those that its entry excepts; itself where it is in all logs."""
    if spec.per is None:
        return [effect]
    if getattr(effect, "logs", None) is not None:
        raise ConfigError(f"model.effects: {effect.name} has both logs and per", allowed="one of them", do="leave logs out: data.groups says which logs")
    levels = tuple(groups[spec.per])
    own = [level for level in levels if level not in (spec.spared or ())]
    if effect.mimics_mass and isinstance(effect, LinkEffect) and len(own) == len(levels):
        warnings.warn(SysidWarning(f"{effect.name} is in every log: what all levels of {spec.per} share of it is the link's own, and the prior alone tells them apart; except: [LEVEL] names the logs without it"), stacklevel=2)
    return [at_level(effect, spec.per, level, levels) for level in own]


def found(spec, folder: Path = Path(), signals=()) -> Effect:
    """The effect that an entry of `model.effects` names, with its options; a file of own effects is relative to `folder`.

    Args:
        signals: names of logged signals, which formulas may use.

    Raises:
        ConfigError: there is none, or not with these options.
    """
    if "formula" in spec.options:
        effect = Formula(spec.options["formula"], spec.options.get("name", "formula"), signals)
        own = {name: value for name, value in spec.options.items() if name not in ("formula", "name")}
    else:
        effect = own_effects.load(spec.name, folder) if is_own(spec.name) else find(spec.name)
        own = spec.options
    words = {shape.name for shape in effect.shapes()}
    chosen = effect.given(**{name: value for name, value in own.items() if name not in words})
    shapes = {shape.name: shape for shape in chosen.shapes()}
    if idle := sorted(words & set(own) - set(shapes)):
        raise ConfigError(f"model.effects: {effect.name} with these options has no {idle[0]}", do="leave it out")
    asked = {name: _asked(effect, shapes[name], value) for name, value in own.items() if name in shapes}
    if asked:
        vars(chosen)["asked"] = asked
    if "formula" in spec.options or is_own(spec.name):
        vars(chosen)["spelled"] = (spec.name, dict(spec.options))
    return chosen


_SAYS = "a number, which is then held, or {start: number, within: [low, high]}"


def _number(effect: Effect, word: str, value) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
        raise ConfigError(f"model.effects: {effect.name}.{word} is {value!r}", allowed=_SAYS, do="give a number or leave it out")
    return float(value)


def _holds(term: int, effect: Effect, joints) -> dict[tuple[int, int, str], float]:
    """{(term, joint, name): value} of the shape values that the user gives."""
    return {(term, joint, word): asked.held for word, asked in effect.asked.items() if asked.held is not None for joint in joints}


def _asked(effect: Effect, shape: Shape, value) -> Asked:
    """What an entry says of a shape value."""
    if not isinstance(value, dict):
        return Asked(held=_number(effect, shape.name, value))
    where = f"model.effects: {effect.name}.{shape.name}"
    if not value or set(value) - {"start", "within"}:
        odd = sorted(map(str, set(value) - {"start", "within"}))
        raise ConfigError(f"{where} has {'the key ' + repr(odd[0]) if odd else 'neither start nor within'}", allowed=_SAYS)
    start = None if value.get("start") is None else _number(effect, f"{shape.name}.start", value["start"])
    bounds = value.get("within")
    if bounds is not None:
        if not isinstance(bounds, (list, tuple)) or len(bounds) != 2:
            raise ConfigError(f"{where}.within is {bounds!r}", allowed="[low, high]")
        bounds = tuple(_number(effect, f"{shape.name}.within", end) for end in bounds)
        if not bounds[0] < bounds[1]:
            raise ConfigError(f"{where}.within is {list(bounds)}", allowed="[low, high], the low below the high")
        if start is not None and not bounds[0] <= start <= bounds[1]:
            raise ConfigError(f"{where}.start is {start:g}, outside {list(bounds)}", do="move the start or widen `within`")
    # of a vocabulary effect a value that has no negative side has none in any file
    signed = "formula" in effect.options or shape.low < 0
    lowest = min(x for x in (start, *(bounds or ())) if x is not None)
    if not signed and (lowest < 0 or (lowest == 0 and shape.low > 0)):
        raise ConfigError(f"{where} may be {lowest:g}", allowed="values above zero" if shape.low > 0 else "values from zero on")
    return Asked(start, bounds)


def moving_coefficients(model: Model, motion: Motion) -> np.ndarray:
    """(coefficients,) bool: False for those of a joint that never moves or whose torque is not used, which no data can tell, and for
    those that are given."""
    silent = (*motion.still, *motion.unused)
    told = lambda c: c.given is None and (c.joint == ROBOT or model.robot.joints[c.joint] not in silent)  # noqa: E731
    out = np.array([told(c) for c in model.coefficients], dtype=bool)
    for at in {c.at for c in model.coefficients} - {None}:  # a joint may stand in all logs of a level
        here = [piece for piece in motion.pieces if piece.levels.get(at[0]) == at[1]]
        stays = never_move(here) if here else np.ones(model.robot.dof, dtype=bool)
        out &= np.array([c.at != at or c.joint == ROBOT or not stays[c.joint] for c in model.coefficients], dtype=bool)
    return out
