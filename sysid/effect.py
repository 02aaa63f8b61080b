"""The contract that a physical effect fulfils. One effect, one small file in `effects/`, found by its name.

Three kinds, in the order that the hardware has:

1. a motion effect changes what moved: its values turn the measured motion into the one that the bodies made;
2. a torque effect adds columns to the equation of motion: coefficients are linear and are solved with the bodies,
   shape values (a Stribeck speed) are not and are found by variable projection;
3. a sensor effect is a linear operator on the predicted torque of a joint: the measurement itself is never transformed.

A coefficient with a lower bound of zero can come out as close to zero as it likes but never below.
"""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from .errors import ConfigError
from .motion import Piece


@dataclass
class Linear:
    """A coefficient that multiplies one column. `unit` is written for a revolute joint; `lower` is 0 or None."""

    unit: str
    lower: float | None = None
    says: str = ""
    name: str = field(default="", init=False)

    def __set_name__(self, owner, name):
        self.name = name


@dataclass
class Shape:
    """A value that the columns are not linear in, from `low` to `high`.

    of: what `low` and `high` are shares of: the joint's top "speed", its greatest "torque", the "angle" it travels, its
        "softness", which is that angle per greatest torque, the "duration" of a log, or "" for plain units. start: the value at which the effect does nothing, from which a
        search begins; None where there is none, and values between the bounds are tried: `grid` of them, in equal
        ratios, or in equal steps where `even` or where a bound is not positive. spacing: of a value that counts periods over
        the angle, the widest step between tried ones that misses nothing, as a share of 1 / (angle travelled); 0 of any other.
    least: what it may differ by and change little, where that is known; respaced: which values to try between two bounds, where
        a formula says so.
    """

    unit: str
    low: float
    high: float
    of: str = ""
    start: float | None = None
    grid: int = 8
    says: str = ""
    even: bool = False
    spacing: float = 0.0
    least: float = 0.0
    respaced: Callable[[float, float], np.ndarray] | None = field(default=None, repr=False, compare=False)
    name: str = field(default="", init=False)

    def __set_name__(self, owner, name):
        self.name = name

    def bounds(self, scale: float, angle: float | None = None) -> tuple[float, float]:
        """The bounds where what they are shares of is `scale`, and a joint travels `angle`: what repeats must be
        seen to: two periods at least, as of fewer a polynomial of the angle makes as much."""
        low, high = self.low * scale, self.high * scale
        return (min(max(low, 4.0 * np.pi / angle), high), high) if self.spacing and angle else (low, high)

    def values(self, low: float, high: float, angle: float | None = None) -> np.ndarray:
        """Values to try between two bounds, ascending.

        Args:
            angle: what the joint travels, where it is known; only `spacing` looks at it.
        """
        if self.respaced is not None:
            return self.respaced(low, high)
        if self.spacing and angle:
            return np.linspace(low, high, 2 + int((high - low) * angle / self.spacing))
        return np.geomspace(low, high, self.grid) if low > 0 and not self.even else np.linspace(low, high, self.grid)


def called(value, name: str):
    """A coefficient or shape value under a name, for an effect whose coefficients depend on its options."""
    out = copy.copy(value)
    out.name = name
    return out


@dataclass(frozen=True)
class Asked:
    """What a user says of a shape value: the value itself, or where the search for it begins, and between which bounds it is."""

    start: float | None = None
    within: tuple[float, float] | None = None
    held: float | None = None


class NotFinite(ConfigError):
    """An effect is no finite number at some shape values."""


class Effect(ABC):
    """A physical effect. Its docstring is a sentence of physics, its class variables what `sysid effects` prints.

    scope: "joint", or "robot" for an effect of the whole robot, whose joint is called `*`.
    options: {name: what it says} of the keys beside `joints` that an experiment file may give.
    tied_with: words of the vocabulary that look alike; `separate_by`: the experiment that tells them apart; maneuvers: the kinds
        of `design.maneuvers` that show it, of those that the harmonics of a designed motion do badly.
    reach: samples on either side of a row that its columns look at; memory: they look back to the start of the log.
    mimics_mass: bodies take its place where a model lacks it, and their masses are off.
    uses_load: they need `motion.load` (n, dof), the torque that the bodies alone are predicted to need.
    elementwise: each row of its columns follows from the joint's own q, qd, qdd and load in that row, and shape values may
        be arrays along the rows: joints can then be treated as samples of one joint.
    given_coefficients: {name: value} of those that the user says.
    simulators: {term: coefficient or shape value} of what it is to a simulator's joint: `damping` times qd, `drag` times
        |qd| qd, `friction` times sign(qd), `breakaway` on top of it from rest, `armature` times qdd, `stiffness` times q,
        `torque` that is constant beside a stiffness, `zero` that is added to q; and of an effect of the whole robot `gravity`
        or `inertia`, a body on a link.
    asked: {shape value: what the user says of it}.
    group, level: of logs, at which alone it is there; None where it is in all (see `per_level`).
    """

    name: ClassVar[str]
    equation: ClassVar[str]
    looks_like: ClassVar[str]
    tied_with: ClassVar[tuple[str, ...]] = ()
    separate_by: ClassVar[str]
    maneuvers: ClassVar[tuple[str, ...]] = ()
    source: ClassVar[str]
    scope: ClassVar[str] = "joint"
    options: ClassVar[dict[str, str]] = {}
    reach: ClassVar[int] = 0
    memory: ClassVar[bool] = False
    group: ClassVar[str | None] = None
    level: ClassVar[str | None] = None
    uses_load: ClassVar[bool] = False
    mimics_mass: ClassVar[bool] = False
    elementwise: ClassVar[bool] = False
    simulators: ClassVar[dict[str, str]] = {}
    given_coefficients: Mapping[str, float] = MappingProxyType({})
    asked: Mapping[str, Asked] = MappingProxyType({})

    @property
    def instantaneous(self) -> bool:
        """Whether what it does follows from q, qd and qdd of the same instant, whatever the clock and other signals say."""
        return not (self.memory or self.reach)

    def coefficients(self) -> tuple[Linear, ...]:
        """The linear coefficients, in the order of the columns."""
        return self._declared(Linear)

    def shapes(self) -> tuple[Shape, ...]:
        """The values that it is not linear in."""
        return self._declared(Shape)

    def sized(self, motion: Piece, rows: int, joint: int) -> tuple[Shape, ...] | None:
        """`shapes()` with the bounds that a motion gives them on a joint, in plain units; None where they say so themselves.

        Args:
            motion: some rows of the motion, then as many, the rows after each. rows: how many it has in all.
        """
        return None

    def _declared(self, what: type) -> tuple:
        """What a class and those it derives from declare, these first."""
        found = {name: value for kind in reversed(type(self).__mro__) for name, value in vars(kind).items()}
        return tuple(value for value in found.values() if isinstance(value, what))

    def given(self, **options) -> Effect:
        """This effect with the options that an experiment file gives it.

        Raises:
            ConfigError: an option that it does not have.
        """
        for name in options:
            if name not in self.options:
                allowed = ", ".join(["joints", *self.options])
                raise ConfigError(f"{self.name} has no option {name!r}", where="model.effects", allowed=allowed, do="see `sysid effects`")
        chosen = copy.copy(self)
        vars(chosen).update(options)
        return chosen

    def bound(self, robot, joint: int) -> Effect:
        """This effect, knowing the robot that it stands on; the same whatever the joint (-1 where its scope is the robot).

        Raises:
            ConfigError: an option names what this robot lacks, or the effect cannot stand on this joint.
        """
        return self

    def present(self, motion: Piece) -> bool:
        """Whether it is there in a motion's log."""
        return True

    def variants(self, robot, joint: int) -> list[dict]:
        """The options under which it is worth trying on a joint (-1 where its scope is the robot), simplest first."""
        return [{}]

    def richer(self, **shapes: float) -> list[tuple[dict, dict[str, float]]]:
        """What may take its place where the model has it: options, with the shape values at which to try these.

        Args:
            shapes: its shape values as the model has them.
        """
        return []


class TorqueEffect(Effect):
    """An effect that adds torque to one joint."""

    @abstractmethod
    def columns(self, motion: Piece, joint: int, **shapes: float) -> np.ndarray:
        """The columns (k, n) that its k coefficients multiply in the torque of a joint.

        Args:
            motion: q, qd, qdd (n, dof) of the whole robot and the logged signals.
            joint: the joint's number.
            shapes: its shape values by name.
        """


class WrenchEffect(Effect):
    """An effect that adds torque to several joints at once."""

    scope = "robot"

    @abstractmethod
    def columns(self, motion: Piece, robot, **shapes: float) -> np.ndarray:
        """The columns (dof, k, n) that its k coefficients multiply in the torque of every joint."""


class MotionEffect(Effect):
    """An effect that changes what moved. It has shape values alone, each with a `start` that changes nothing."""

    @abstractmethod
    def moved(self, motion: Piece, joint: int, **shapes: float) -> Piece:
        """The motion that the bodies made where `motion` was measured; `joint` is -1 where its scope is the robot."""

    def tries(self, bounds: dict[str, tuple[float, float]]) -> list[dict[str, float]]:
        """Sets of shape values worth trying beside the start, where a search that begins there may lose its way.

        Args:
            bounds: (low, high) of each shape value here.
        """
        return []


class SensorEffect(Effect):
    """A linear operator on the predicted torque of a joint. It has shape values alone, each with a `start`.

    constant_gain: it multiplies torque by one number, and may do so behind any filter.
    """

    constant_gain: ClassVar[bool] = False

    @abstractmethod
    def sensed(self, torque: np.ndarray, step: float, **shapes: float) -> np.ndarray:
        """What the sensor makes of torque (k, n), sampled every `step` seconds; same shape."""

    def gain(self, **shapes: float) -> float:
        """The number by which a constant gain multiplies torque."""
        return float(self.sensed(np.ones((1, 1)), 1.0, **shapes)[0, 0])


class LinkEffect(WrenchEffect):
    """An effect on one link: the one that its option `link` names, by default the last."""

    link = None

    def bound(self, robot, joint):
        bound = self.given()
        bound.link = robot.bodies[self.body(robot)].name
        return bound

    def body(self, robot) -> int:
        """Number of the link's body. Raises ConfigError where the robot has no such link."""
        if self.link is None:
            return last_link(robot)
        links = {body.name: number for number, body in enumerate(robot.bodies) if body.kind == "link"}
        one_of(self, "link", list(links))
        return links[self.link]


class Deflection(MotionEffect):
    """An effect by which a joint's link stands behind its motor under load.

    encoder: "motor" where the encoder turns with the motor: the link is behind what was measured;
        "joint" where it turns with the link: the motor is ahead of what was measured.
    blows: the link is stopped by what it strikes.
    """

    options = {"encoder": "motor where the encoder turns with the motor, joint where it turns with the link (default motor)"}
    memory = True
    uses_load = True
    blows: ClassVar[bool] = False

    encoder = "motor"

    def given(self, **options):
        chosen = super().given(**options)
        one_of(chosen, "encoder", ("motor", "joint"))
        return chosen

    def variants(self, robot, joint):
        return [{"encoder": "motor"}, {"encoder": "joint"}]

    @abstractmethod
    def behind(self, load: np.ndarray, inertia: np.ndarray, step: float, **shapes: float) -> np.ndarray:
        """How far (n,) the link stands behind its motor.

        Args:
            load: (n,) what the link would need of its drive did it follow what was measured, every `step` seconds.
            inertia: (n,) of the link about the joint, zero where what was measured is the link.
        """

    def apart(self, load: np.ndarray, inertia: np.ndarray, motion: Piece, **shapes: float) -> np.ndarray:
        """`behind` with its first two derivatives (3, n), as the encoder sees it.

        Of a link that is measured nothing is left to move by itself. The load is that of angles seen through a filter: what is
        linear in it has been seen through it too, and blows, which are not, must be, as the motor's answer to them was.
        """
        (one,) = self.several([(load, inertia, motion, shapes)])
        return one

    def several(self, cases: list[tuple]) -> list[np.ndarray]:
        """`apart` of several links: (load, inertia, motion, shapes) each."""
        motor = self.encoder == "motor"
        behind = self.links([(load, inertia if motor else 0.0 * inertia, motion.step, shapes) for load, inertia, motion, shapes in cases])
        return [
            rates(motion.sight.smoothed(own) if self.blows and motion.sight is not None else own, motion.step)
            for own, (_, _, motion, _) in zip(behind, cases)
        ]

    def links(self, cases: list[tuple]) -> list[np.ndarray]:
        """`behind` of several links: (load, inertia, step, shapes) each."""
        return [self.behind(load, inertia, step, **shapes) for load, inertia, step, shapes in cases]

    def tries(self, bounds):
        return self.flights(bounds) if self.encoder == "motor" else []

    def flights(self, bounds: dict[str, tuple[float, float]]) -> list[dict[str, float]]:
        """`tries` of a link that moves by itself."""
        return []

    def moved(self, motion, joint, *, behind=None, **shapes):
        """As `MotionEffect.moved`.

        Args:
            behind: (3, n) `apart` on these rows, which looks back to the start of the log; None: without the link's inertia.
        """
        if behind is None:
            load = motion.load[:, joint]
            behind = self.apart(load, 0.0 * load, motion, **shapes)
        deflection = np.zeros((3, *motion.q.shape)) if motion.deflection is None else motion.deflection.copy()
        deflection[:, :, joint] += behind
        if self.encoder == "motor":
            return replace(motion, deflection=deflection)
        ahead = [np.array(x) for x in (motion.q, motion.qd, motion.qdd)]
        for values, own in zip(ahead, behind):
            values[:, joint] += own
        return replace(motion, q=ahead[0], qd=ahead[1], qdd=ahead[2], deflection=deflection)


def whole(effect: Effect, option: str, most: int) -> None:
    """Refuse an option that is no whole number from 1 to `most`."""
    value = getattr(effect, option)
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
        raise ConfigError(f"{effect.name}.{option} is {value!r}", where="model.effects", allowed=f"a whole number, 1 to {most}")


def one_of(effect: Effect, option: str, allowed, do: str | None = None) -> None:
    """Refuse an option that is not one of the allowed words."""
    value = getattr(effect, option)
    if value not in allowed:
        raise ConfigError(f"{effect.name}.{option} is {value!r}", where="model.effects", allowed=", ".join(allowed), do=do)


def texts(effect: Effect, option: str) -> None:
    """Refuse an option that is neither left out nor a list of texts."""
    value = getattr(effect, option)
    if value is not None and not (isinstance(value, list) and value and all(isinstance(item, str) for item in value)):
        raise ConfigError(f"{effect.name}.{option} is {value!r}", where="model.effects", allowed="a list of names")


def last_link(robot) -> int:
    """Number of the last link's body, which on an arm carries the tool."""
    return max(number for number, body in enumerate(robot.bodies) if body.kind == "link")


def rates(values: np.ndarray, step: float) -> np.ndarray:
    """Values (n,) sampled every `step` seconds with their first two derivatives (3, n), by central differences."""
    if len(values) < 3:
        return np.stack([values, np.zeros(len(values)), np.zeros(len(values))])
    second = np.diff(values, 2) / step**2
    return np.stack([values, np.gradient(values, step), np.concatenate([second[:1], second, second[-1:]])])


KINDS = (TorqueEffect, WrenchEffect, MotionEffect, SensorEffect)


def vocabulary() -> list[str]:
    """The names of all effects: the modules of `effects/`."""
    from . import effects

    return sorted(module.name for module in iter_modules(effects.__path__))


@cache
def find(name: str) -> Effect:
    """The effect of that name.

    Raises:
        ConfigError: there is none; the closest names are given.
    """
    import difflib

    names = vocabulary()
    if name not in names:
        close = difflib.get_close_matches(name.lower(), names, n=3, cutoff=0.5) or names
        raise ConfigError(f"there is no effect {name!r}", allowed=", ".join(close), do="`sysid effects` lists all")
    module = import_module(f"sysid.effects.{name}")
    (kind,) = [
        value for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Effect) and value.__module__ == module.__name__
    ]  # fmt: skip
    return kind()


def kind(effect: Effect) -> str:
    """motion, torque or sensor: the place of an effect in the hardware."""
    return "motion" if isinstance(effect, MotionEffect) else "sensor" if isinstance(effect, SensorEffect) else "torque"


def describe(effect: Effect) -> dict:
    """What `sysid effects` prints of an effect."""
    return {
        "name": effect.name, "summary": " ".join((type(effect).__doc__ or "").split()), "kind": kind(effect), "scope": effect.scope,
        "equation": effect.equation,
        "parameters": [
            {"name": c.name, "unit": c.unit, "lower": c.lower, "says": c.says} for c in effect.coefficients()
        ] + [
            {"name": s.name, "unit": s.unit, "lower": s.low, "upper": s.high, "share_of": s.of, "start": s.start, "says": s.says} for s in effect.shapes()
        ],
        "options": dict(effect.options), "looks_like": effect.looks_like, "tied_with": list(effect.tied_with),
        "separate_by": effect.separate_by, "maneuvers": list(effect.maneuvers), "source": effect.source,
    }  # fmt: skip
