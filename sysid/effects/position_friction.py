"""Friction that changes with the angle."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_options import one_of, whole
from ..effect_parameters import Linear, called


class PositionFriction(TorqueEffect):
    """Misaligned bearings, teeth and seals rub more at some angles than at others."""

    name = "position_friction"
    equation = "tau = sum_k (a_k cos(k q) + b_k sin(k q)) w, w = sign(qd) or qd"
    looks_like = "friction that changes with the angle and turns its sign with the direction"
    tied_with = ("cogging", "spring", "cable")
    separate_by = "the same slow scan both ways: half the difference is friction, half the sum is not"
    maneuvers = ("ladder",)
    source = "Bittencourt, Wernholt, Sander-Tavallaey & Brogardh 2010"
    elementwise = True
    options = {
        "times": "what the sum multiplies: direction, as Coulomb friction, or speed, as viscous friction (default direction)",
        "harmonics": "how many k, from 1 (default 3)",
    }

    nested = ("harmonics",)

    times = "direction"
    harmonics = 3

    def given(self, **options):
        chosen = super().given(**options)
        one_of(chosen, "times", ("direction", "speed"))
        whole(chosen, "harmonics", 12)
        return chosen

    def coefficients(self):
        unit = "N m" if self.times == "direction" else "N m s/rad"
        part = {"a": "cosine", "b": "sine"}
        return tuple(
            called(Linear(unit, says=f"{part[word]} of {k} times the angle"), f"{word}{k}") for k in range(1, self.harmonics + 1) for word in "ab"
        )

    def variants(self, robot, joint):
        # of a short travel several harmonics are nearly one curve, and their coefficients no numbers of its friction
        return [{"times": times, **few} for few in ({"harmonics": 1}, {"harmonics": 2}, {}) for times in ("direction", "speed")]

    def richer(self, **shapes):
        own = type(self).harmonics
        return [({"times": self.times, "harmonics": count}, {}) for count in range(self.harmonics + 1, own + 1)]

    def columns(self, motion, joint):
        weight = motion.direction(joint) if self.times == "direction" else motion.qd[:, joint]
        angles = np.arange(1, self.harmonics + 1)[:, None] * motion.q[:, joint]
        return np.stack([np.cos(angles) * weight, np.sin(angles) * weight], axis=1).reshape(2 * self.harmonics, -1)
