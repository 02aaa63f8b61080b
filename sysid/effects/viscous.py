"""Viscous friction."""

from ..effect import TorqueEffect
from ..effect_parameters import Linear


class Viscous(TorqueEffect):
    """Lubricant shears: friction in proportion to speed."""

    name = "viscous"
    equation = "tau = Fv qd"
    looks_like = "residual in proportion to speed"
    tied_with = ("warmup",)
    separate_by = "constant speeds, both ways, cold and warm"
    maneuvers = ("ladder",)
    source = "Rucker & Wensing 2022, eq. 14"
    elementwise = True
    simulators = {"damping": "Fv"}

    Fv = Linear("N m s/rad", lower=0, says="viscous coefficient; includes the motor's back-EMF where torque is a voltage")

    def columns(self, motion, joint):
        return motion.qd[None, :, joint]
