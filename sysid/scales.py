"""How far, how fast and how hard each joint goes in a motion: what shape values are searched over."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from .extent import Extent
from .model_parameters import ROBOT
from .motion import Motion, Piece


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
