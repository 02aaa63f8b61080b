"""A constant error of the torque signal."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_parameters import Linear


class TorqueBias(TorqueEffect):
    """The torque sensor or the current sensor reads a constant where there is nothing."""

    name = "torque_bias"
    equation = "tau = b"
    looks_like = "a constant residual"
    tied_with = ("asymmetric_coulomb", "gravity on a joint that always holds the same load")
    separate_by = "torque at rest: a bias stays, friction goes"
    same_in_motion = ("asymmetric_coulomb",)
    maneuvers = ("poses",)
    source = "Janot, Gautier & Brunot 2019 (the offset of EMPS)"
    mimics_mass = True
    elementwise = True

    b = Linear("N m", says="offset")

    def columns(self, motion, joint):
        return np.ones((1, len(motion.t)))
