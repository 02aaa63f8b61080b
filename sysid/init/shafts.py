"""A joint's angle that is its motor's shaft's: many turns, and torques that go with them behind a
gear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..check.equations import Reading
from ..check.look import Look
from ..units import DEGREE
from .guess import Guess

_RATIOS = np.geomspace(5.0, 400.0, 45)  # tenth by tenth
_BETTER = 1.0  # log of the squares: what another ratio leaves is a third of what degrees leave
_STEPS = 3  # of three values about the best, each time nearer together


def ratio(look: Look, joint: str) -> float | None:
    """The gear's ratio by which one joint's angle explains the torques clearly better than as
    degrees; None where none does, or where the least is at an end."""
    equations = look.equations
    if equations is None:
        return None
    plain, own = Reading.plain(look.robot.dof), look.robot.joints.index(joint)

    def loss(value: float) -> float:
        factor = np.where(np.arange(look.robot.dof) == own, 1.0 / value, 1.0)
        return equations.scored(replace(plain, angle_factor=tuple(factor))).loss

    losses = [loss(value) for value in _RATIOS]
    at = int(np.argmin(losses))
    if at in (0, len(_RATIOS) - 1):
        return None
    best, apart = _RATIOS[at], _RATIOS[at + 1] / _RATIOS[at]
    for _ in range(_STEPS):
        apart = np.sqrt(apart)
        best = min((best / apart, best, best * apart), key=loss)
    return float(best) if loss(best) < loss(1.0 / DEGREE) - _BETTER else None


def told(look: Look, angles: Guess, found: float) -> Guess:
    """That the angle of `angles.alone` is a motor's shaft's, behind a gear of about that ratio."""
    joint, value = angles.alone, float(f"{1.0 / found:.3g}")
    why = f"as the angle of a motor's shaft, behind a gear of about {found:.3g}, it goes with the "
    why += "torques of the URDF's robot, and not as degrees"
    column = look.column("position", joint) or "ITS COLUMN"
    doubt = f"{angles.why}: write 1 / (the gear's ratio), with its sign, as you know it"
    return Guess("data.position", {joint: {column: value}}, why, doubt)
