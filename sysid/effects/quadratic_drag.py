"""Drag that grows with the square of speed."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_parameters import Linear


class QuadraticDrag(TorqueEffect):
    """Fluid is pushed aside and churned: resistance in proportion to the square of the speed."""

    name = "quadratic_drag"
    equation = "tau = c |qd| qd"
    looks_like = "residual that is odd in the speed and grows faster than it"
    tied_with = ("stribeck", "sublinear_viscous", "warmup")
    separate_by = "a wide ladder of constant speeds at a fixed temperature"
    maneuvers = ("ladder",)
    source = "the drag equation at high Reynolds number; no reference"
    elementwise = True
    simulators = {"drag": "c"}

    c = Linear("N m s^2/rad^2", lower=0, says="drag coefficient")

    def columns(self, motion, joint):
        qd = motion.qd[None, :, joint]
        return np.abs(qd) * qd
