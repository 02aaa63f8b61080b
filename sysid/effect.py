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
from collections.abc import Mapping, Sequence
from functools import cache
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from .effect_options import one_of
from .effect_parameters import Asked, Linear, Shape
from .errors import ConfigError
from .motion import Piece
from .units import of_joint


class NotFinite(ConfigError):
    """An effect is no finite number at some shape values."""


class Effect(ABC):
    """A physical effect. Its docstring is a sentence of physics, its class variables what `sysid effects` prints.

    scope: "joint", or "robot" for an effect of the whole robot, whose joint is called `*`.
    options: {name: what it says} of the keys beside `joints` that an experiment file may give.
    nested: options that say how many terms of the same sum there are.
    tied_with: words of the vocabulary that look alike; `separate_by`: the experiment that tells them apart; maneuvers: the kinds
        of `design.maneuvers` that show it, of those that the harmonics of a designed motion do badly; same_in_motion: those that
        are the same column while the joint moves.
    reach: samples on either side of a row that its columns look at; memory: they look back to the start of the log.
    mimics_mass: bodies take its place where a model lacks it, and their masses are off.
    uses_load: they need `motion.load` (n, dof), the torque that the bodies alone are predicted to need; uses_needed: and
        `motion.needed`, that of all that is in the model but such effects.
    elementwise: each row of its columns follows from the joint's own q, qd, qdd and load in that row, and shape values may
        be arrays along the rows: joints can then be treated as samples of one joint.
    given_coefficients: {name: value} of those that the user says.
    simulators: {term: coefficient or shape value} of what it is to a simulator's joint: `damping` times qd, `drag` times
        |qd| qd, `friction` times sign(qd), `breakaway` on top of it from rest, `armature` times qdd, `stiffness` times q,
        `torque` that is constant beside a stiffness, `zero` that is added to q; and of an effect of the whole robot `gravity`
        or `inertia`, a body on a link.
    asked: {shape value: what the user says of it}.
    either_way: of some logs and of all others, with the other sign, it is the same beside what all share.
    needs_logs: it is there in some logs alone, which are named.
    group, level: of logs, at which alone it is there; None where it is in all (see `per_level`).
    """

    name: ClassVar[str]
    equation: ClassVar[str]
    looks_like: ClassVar[str]
    tied_with: ClassVar[tuple[str, ...]] = ()
    separate_by: ClassVar[str]
    maneuvers: ClassVar[tuple[str, ...]] = ()
    same_in_motion: ClassVar[tuple[str, ...]] = ()
    source: ClassVar[str]
    scope: ClassVar[str] = "joint"
    options: ClassVar[dict[str, str]] = {}
    nested: ClassVar[tuple[str, ...]] = ()
    reach: ClassVar[int] = 0
    memory: ClassVar[bool] = False
    group: ClassVar[str | None] = None
    level: ClassVar[str | None] = None
    uses_load: ClassVar[bool] = False
    uses_needed: ClassVar[bool] = False
    mimics_mass: ClassVar[bool] = False
    elementwise: ClassVar[bool] = False
    either_way: ClassVar[bool] = False
    needs_logs: ClassVar[bool] = False
    simulators: ClassVar[dict[str, str]] = {}
    given_coefficients: Mapping[str, float] = MappingProxyType({})
    asked: Mapping[str, Asked] = MappingProxyType({})

    @property
    def instantaneous(self) -> bool:
        """Whether what it does follows from q, qd and qdd of the same instant, whatever the clock and other signals say."""
        return not (self.memory or self.reach)

    def coefficients(self) -> tuple[Linear, ...]:
        """The linear coefficients, in the order of the columns."""
        return _declared(type(self), Linear)

    def shapes(self) -> tuple[Shape, ...]:
        """The values that it is not linear in."""
        return _declared(type(self), Shape)

    def sized(self, motion: Piece, rows: int, joint: int) -> tuple[Shape, ...] | None:
        """`shapes()` with the bounds that a motion gives them on a joint, in plain units; None where they say so themselves.

        Args:
            motion: some rows of the motion, then as many, the rows after each. rows: how many it has in all.
        """
        return None

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

    def unit_on(self, unit: str, robot, joint: int) -> str:
        """A unit of its values, written for a revolute joint, as it reads on a joint of a robot."""
        return of_joint(unit, prismatic=bool(robot.prismatic[joint]))

    def present(self, motion: Piece) -> bool:
        """Whether it is there in a motion's log."""
        return True

    def variants(self, robot, joint: int) -> list[dict]:
        """The options under which it is worth trying on a joint (-1 where its scope is the robot), simplest first."""
        return [{}]

    def among(self, logs: Sequence[str]) -> list[dict]:
        """The options under which it is worth trying in some of an experiment's training logs alone, by their names. Where each is
        tried alone, logs that have much of its first coefficient are then tried together."""
        return []

    def places(self, robot) -> list[dict]:
        """The options of where on the robot it is worth trying, beside those of the others."""
        return [{}]

    def richer(self, **shapes: float) -> list[tuple[dict, dict[str, float]]]:
        """What may take its place where the model has it: options, with the shape values at which to try these.

        Args:
            shapes: its shape values as the model has them.
        """
        return []


@cache
def _declared(kind: type[Effect], what: type) -> tuple:
    """What a class and those it derives from declare, these first."""
    # copies: Python itself adds to a class that is asked for its annotations in another thread
    found = {name: value for one in reversed(kind.__mro__) for name, value in dict(vars(one)).items()}
    return tuple(value for value in found.values() if isinstance(value, what))


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

    def slides_over(self, joint: int, dof: int) -> np.ndarray:
        """The speeds (k, dof), as sums of the joints', with whose signs the torque of a joint changes, beside its own: where one of
        them is none, friction may have any value up to its greatest, and such rows say nothing of it."""
        return np.zeros((0, dof))

    def columns_at(self, motion: Piece, joint: int, tried: list[dict[str, float]]) -> np.ndarray:
        """`columns` (tried, k, n) at several sets of shape values."""
        return np.stack([self.columns(motion, joint, **shapes) for shapes in tried])


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


def last_link(robot) -> int:
    """Number of the last link's body, which on an arm carries the tool."""
    return max(number for number, body in enumerate(robot.bodies) if body.kind == "link")


KINDS = (TorqueEffect, WrenchEffect, MotionEffect, SensorEffect)


def kind(effect: Effect) -> str:
    """motion, torque or sensor: the place of an effect in the hardware."""
    return "motion" if isinstance(effect, MotionEffect) else "sensor" if isinstance(effect, SensorEffect) else "torque"
