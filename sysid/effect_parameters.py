"""What an effect has to be found: linear coefficients, shape values, and what a user asks of these."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np


@dataclass
class Linear:
    """A coefficient that multiplies one column. `unit` is written for a revolute joint; `lower` is 0 or None; of_body: it is one of
    ten in a row, the inertial parameters of a body."""

    unit: str
    lower: float | None = None
    says: str = ""
    of_body: bool = False
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
