"""Coulomb friction."""

from ..effect import TorqueEffect
from ..effect_parameters import Linear


class Coulomb(TorqueEffect):
    """Dry contact slides: friction of constant size against the motion."""

    name = "coulomb"
    equation = "tau = Fc sign(qd)"
    looks_like = "a step wherever the speed changes sign"
    tied_with = ("torque_bias", "asymmetric_coulomb")
    separate_by = "slow sweeps both ways"
    maneuvers = ("ladder",)
    source = "Rucker & Wensing 2022, eq. 14"
    elementwise = True
    simulators = {"friction": "Fc"}

    Fc = Linear("N m", lower=0, says="friction torque while sliding")

    def columns(self, motion, joint):
        return motion.direction(joint)[None]
