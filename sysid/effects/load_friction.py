"""Friction that grows with load."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_parameters import Linear


class LoadFriction(TorqueEffect):
    """What a gear carries presses its teeth and bearings together: Coulomb friction in proportion to the load torque.

    The load is the torque predicted for the bodies alone; the measured one would bring its noise and the friction itself.
    """

    name = "load_friction"
    equation = "tau = mu |tau_load| sign(qd)"
    looks_like = "a step at reversals whose height grows with the load torque"
    tied_with = ("directional_efficiency", "torque_gain", "coulomb")
    separate_by = "the same slow sweep under three loads"
    source = "Hamon 2010; Bittencourt & Gunnarsson 2012"
    uses_load = True
    elementwise = True

    mu = Linear("1", lower=0, says="friction torque per load torque")

    def columns(self, motion, joint):
        return (np.abs(motion.load[:, joint]) * motion.direction(joint))[None]
