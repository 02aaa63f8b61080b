"""The contract that a physical effect fulfils. One effect, one small file in `effects/`, found by its name.

A torque effect adds columns to the equation of motion of one joint: its coefficients are linear and are solved
with the bodies. A coefficient with a lower bound of zero is solved as an exponential, as the paper does for
friction, and can come out as close to zero as it likes but never below.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
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


class Effect(ABC):
    """A physical effect. Its docstring is a sentence of physics, its class variables what `sysid effects` prints."""

    name: ClassVar[str]
    equation: ClassVar[str]
    looks_like: ClassVar[str]
    tied_with: ClassVar[tuple[str, ...]] = ()
    separate_by: ClassVar[str]
    source: ClassVar[str]

    @classmethod
    def coefficients(cls) -> tuple[Linear, ...]:
        """The linear coefficients, in the order of the columns."""
        return tuple(value for value in vars(cls).values() if isinstance(value, Linear))


class TorqueEffect(Effect):
    """An effect that adds torque to one joint."""

    @abstractmethod
    def columns(self, motion: Piece, joint: int) -> np.ndarray:
        """The columns (k, n) that its k coefficients multiply in the torque of a joint.

        Args:
            motion: q, qd, qdd (n, dof) of the whole robot and the logged signals.
            joint: the joint's number.
        """


def vocabulary() -> list[str]:
    """The names of all effects: the modules of `effects/`."""
    from . import effects

    return sorted(module.name for module in iter_modules(effects.__path__))


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


def describe(effect: Effect) -> dict:
    """What `sysid effects` prints of an effect."""
    kind = type(effect)
    return {
        "name": effect.name, "summary": " ".join((kind.__doc__ or "").split()), "equation": effect.equation,
        "parameters": [
            {"name": c.name, "unit": c.unit, "lower": c.lower, "says": c.says} for c in kind.coefficients()
        ],
        "looks_like": effect.looks_like, "tied_with": list(effect.tied_with), "separate_by": effect.separate_by,
        "source": effect.source,
    }  # fmt: skip
