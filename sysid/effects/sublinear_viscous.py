"""Viscous friction that grows more slowly than speed."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_parameters import Linear, Shape


class SublinearViscous(TorqueEffect):
    """Grease thins as it shears, so that friction grows with a power of the speed below one."""

    name = "sublinear_viscous"
    equation = "tau = Fa |qd|^a sign(qd), 0 < a < 1"
    looks_like = "residual that is odd in the speed and bends down as it grows"
    tied_with = ("stribeck", "quadratic_drag", "warmup")
    separate_by = "a ladder of constant speeds, at several temperatures"
    maneuvers = ("ladder",)
    source = "Wolf & Iskandar 2018"
    elementwise = True

    Fa = Linear("N m (s/rad)^a", lower=0, says="friction at unit speed")
    a = Shape("1", 0.1, 0.9, even=True, says="power of the speed: 0 is Coulomb friction, 1 viscous")

    def columns(self, motion, joint, a):
        return (np.abs(motion.qd[:, joint]) ** a * motion.direction(joint))[None]
