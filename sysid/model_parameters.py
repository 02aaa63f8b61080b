"""The parameters of a model by name: coefficients, and shape values that its columns are not linear in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .effect import Effect
from .effect_parameters import Shape

ROBOT = -1  # the "joint" of an effect of the whole robot, called `*`


def place(joint: int, joints: Sequence[str]) -> str:
    """The name of a joint by its number, `*` of the whole robot."""
    return "*" if joint == ROBOT else joints[joint]


@dataclass(frozen=True)
class Coefficient:
    """One linear coefficient of an effect on a joint (-1: on the robot). given: its value, where the user says it; term: the
    model's, -1 where it is no model's; at: the (group, level) of logs that have it, None where all do; of_body: as of `Linear`."""

    effect: str
    joint: int
    name: str
    unit: str
    positive: bool
    given: float | None = None
    term: int = -1
    at: tuple[str, str] | None = None
    of_body: bool = False


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


def holds(term: int, effect: Effect, joints) -> dict[tuple[int, int, str], float]:
    """{(term, joint, name): value} of the shape values that the user gives."""
    return {(term, joint, word): asked.held for word, asked in effect.asked.items() if asked.held is not None for joint in joints}
