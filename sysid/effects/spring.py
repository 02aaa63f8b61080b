"""A spring across the joint."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_parameters import Linear


class Spring(TorqueEffect):
    """A balancing spring, or a hose bundle, pulls the joint towards an angle q0 = -c/k."""

    name = "spring"
    equation = "tau = k (q - q0) = k q + c, c = -k q0"
    looks_like = "residual in proportion to the angle"
    tied_with = ("cable", "torque_bias", "gravity on a joint that swings a little")
    separate_by = "another payload: gravity grows with it, a spring does not"
    source = "Hooke's law"
    mimics_mass = True
    elementwise = True
    simulators = {"stiffness": "k", "torque": "c"}

    k = Linear("N m/rad", lower=0, says="stiffness")
    c = Linear("N m", says="torque at angle zero, -k q0; the same column as torque_bias")

    def columns(self, motion, joint):
        q = motion.q[:, joint]
        return np.stack([q, np.ones(len(q))])
