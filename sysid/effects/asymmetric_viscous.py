"""Viscous friction that differs between the two directions."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_parameters import Linear


class AsymmetricViscous(TorqueEffect):
    """Friction grows with speed faster one way than the other; `viscous` is the mean of both ways."""

    name = "asymmetric_viscous"
    equation = "tau = dFv/2 |qd|, dFv = Fv+ - Fv-"
    looks_like = "residual in proportion to |qd|, of one sign"
    tied_with = ("asymmetric_coulomb", "torque_bias")
    separate_by = "a ladder of constant speeds, both ways"
    maneuvers = ("ladder",)
    source = "the asymmetric counterpart of viscous friction; no reference"
    elementwise = True

    dFv = Linear("N m s/rad", says="how much larger the viscous coefficient is forwards than backwards")

    def columns(self, motion, joint):
        return 0.5 * np.abs(motion.qd[None, :, joint])
