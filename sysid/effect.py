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
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import ClassVar

import numpy as np

from .errors import ConfigError
from .preprocess import Piece


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

    of: what `low` and `high` are shares of: the joint's top "speed", its greatest "torque", the "angle" it travels, the
        "duration" of a log, or "" for plain units. start: the value at which the effect does nothing, from which a
        search begins; None where there is none, and `grid` values between the bounds are tried.
    """

    unit: str
    low: float
    high: float
    of: str = ""
    start: float | None = None
    grid: int = 8
    says: str = ""
    name: str = field(default="", init=False)

    def __set_name__(self, owner, name):
        self.name = name

    def values(self, low: float, high: float) -> np.ndarray:
        """(grid,) values between two bounds, in equal ratios where both are positive."""
        return np.geomspace(low, high, self.grid) if low > 0 else np.linspace(low, high, self.grid)


class Effect(ABC):
    """A physical effect. Its docstring is a sentence of physics, its class variables what `sysid effects` prints.

    scope: "joint", or "robot" for an effect of the whole robot, whose joint is called `*`.
    options: {name: what it says} of the keys beside `joints` that an experiment file may give.
    tied_with: words of the vocabulary that look alike; `separate_by`: the experiment that tells them apart.
    reach: samples on either side of a row that its columns look at; memory: they look back to the start of the log.
    uses_load: they need `motion.load` (n, dof), the torque that the bodies alone are predicted to need.
    """

    name: ClassVar[str]
    equation: ClassVar[str]
    looks_like: ClassVar[str]
    tied_with: ClassVar[tuple[str, ...]] = ()
    separate_by: ClassVar[str]
    source: ClassVar[str]
    scope: ClassVar[str] = "joint"
    options: ClassVar[dict[str, str]] = {}
    reach: ClassVar[int] = 0
    memory: ClassVar[bool] = False
    uses_load: ClassVar[bool] = False

    def coefficients(self) -> tuple[Linear, ...]:
        """The linear coefficients, in the order of the columns."""
        return tuple(value for value in vars(type(self)).values() if isinstance(value, Linear))

    def shapes(self) -> tuple[Shape, ...]:
        """The values that it is not linear in."""
        return tuple(value for value in vars(type(self)).values() if isinstance(value, Shape))

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

    def variants(self, robot, joint: int) -> list[dict]:
        """The options under which it is worth trying on a joint (-1 where its scope is the robot), simplest first."""
        return [{}]


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


class SensorEffect(Effect):
    """A linear operator on the predicted torque of a joint. It has shape values alone, each with a `start`."""

    @abstractmethod
    def sensed(self, torque: np.ndarray, step: float, **shapes: float) -> np.ndarray:
        """What the sensor makes of torque (k, n), sampled every `step` seconds; same shape."""


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
        close = difflib.get_close_matches(name, names, n=3, cutoff=0.5) or names
        raise ConfigError(f"there is no effect {name!r}", allowed=", ".join(close), do="see `sysid effects`")
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
            {"name": s.name, "unit": s.unit, "lower": s.low, "upper": s.high, "share_of": s.of, "says": s.says} for s in effect.shapes()
        ],
        "options": dict(effect.options), "looks_like": effect.looks_like, "tied_with": list(effect.tied_with),
        "separate_by": effect.separate_by, "source": effect.source,
    }  # fmt: skip
