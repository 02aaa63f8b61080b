"""How large a change is, by all that was seen since it began."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import units
from ..changes.fitted import possible
from ..inertia import PARAMETERS, UNITS
from ..projection import of_data
from ..robot import Robot
from ..vocabulary import find
from .monitor import PAYLOAD, PER_JOINT, Ticks


@dataclass(frozen=True)
class Change:
    """What changed: effect and joint, and its parameters {name: (value, std, unit)}, std
    infinite of what the data do not tell; seconds that they rest on."""

    effect: str
    joint: str
    parameters: dict[str, tuple[float, float, str]]
    seconds: float


def settled(effect: str, joint: str, robot: Robot, since: Ticks, wide: float) -> Change:
    """A change by the ticks since it began; a payload as a body that is physically possible.

    Deviations are those of whitened noise and of the held model, `wide` times as large.
    """
    seconds = float(since.t[-1] - since.t[0]) if len(since.t) > 1 else 0.0
    if effect != PAYLOAD:
        j, k = robot.joints.index(joint), PER_JOINT.index(effect)
        b, g = float(since.own_b[:, j, k].sum()), float(since.own_g[:, j, k].sum())
        (own,) = find(effect).coefficients()
        unit = units.of_joint(own.unit, prismatic=bool(robot.prismatic[j]))
        spread = g + float((since.own_a[:, j, k].sum(axis=0) ** 2).sum())
        value, std = (b / g, wide * spread**0.5 / g) if g > 0.0 else (0.0, np.inf)
        return Change(effect, joint, {f"{effect}.{joint}.{own.name}": (value, std, unit)}, seconds)
    b, g = since.body_b.sum(axis=0), since.body_g.sum(axis=0)
    products = np.zeros((11, 11))
    products[:10, :10], products[:10, 10], products[10, :10] = g, b, b
    products[10, 10] = b @ np.linalg.lstsq(g, b, rcond=None)[0] + 1.0
    c, around = possible(products, list(range(10)), slice(0, 10))
    inverse, model = np.linalg.pinv(g + around, hermitian=True), since.body_a.sum(axis=0)
    covariance = inverse @ (g + model @ model.T) @ inverse
    # what the prior tells rather than the data has no deviation that they know
    known = of_data(inverse @ g @ inverse, inverse, np.eye(10))
    stds = np.where(known, wide * np.sqrt(np.maximum(np.diagonal(covariance), 0.0)), np.inf)
    own = {
        f"payload.*.{word}": (float(v), float(s), unit)
        for word, v, s, unit in zip(PARAMETERS, c, stds, UNITS)
    }
    return Change(effect, joint, own, seconds)
