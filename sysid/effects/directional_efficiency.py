"""A transmission that loses more while it drives than while it is driven."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_parameters import Linear


class DirectionalEfficiency(TorqueEffect):
    """A gear passes on only a part eta of the torque while the motor drives the load; driven by the load it loses less."""

    name = "directional_efficiency"
    equation = "tau = e tau_load where tau_load qd > 0, else 0; e = 1/eta - 1"
    looks_like = "residual in proportion to the load torque, only while power flows from the motor to the load"
    tied_with = ("load_friction", "torque_gain")
    separate_by = "the same sweep up against gravity and down with it, at two loads"
    source = "Wang & Kim 2015"
    uses_load = True
    elementwise = True

    e = Linear("1", lower=0, says="extra share of the load torque needed while driving: 1/eta - 1")

    def columns(self, motion, joint):
        load = motion.load[:, joint]
        return np.where(load * motion.direction(joint) > 0, load, 0.0)[None]
