"""The Stribeck bump of friction."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_parameters import Linear, Shape


class Stribeck(TorqueEffect):
    """Friction is larger at creeping speed, before the lubricant carries the contact."""

    name = "stribeck"
    equation = "tau = dF exp(-(qd/vs)^2) sign(qd)"
    looks_like = "a bump at speeds below about 3 vs, odd in the speed"
    tied_with = ("presliding", "quadratic_drag", "sublinear_viscous")
    separate_by = "creep both ways at several constant speeds, without reversing"
    maneuvers = ("ladder",)
    source = "Armstrong 1994"
    elementwise = True
    simulators = {"breakaway": "dF"}

    dF = Linear("N m", lower=0, says="friction on the verge of motion above that while sliding")
    vs = Shape("rad/s", 0.003, 0.7, of="speed", grid=10, says="Stribeck speed")

    def columns(self, motion, joint, vs):
        return (np.exp(-((motion.qd[:, joint] / vs) ** 2)) * motion.direction(joint))[None]
