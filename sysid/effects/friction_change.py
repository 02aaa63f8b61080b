"""Friction that is another in some logs."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_parameters import Linear
from ..in_logs import InLogs


class FrictionChange(InLogs, TorqueEffect):
    """Friction is another in some logs than in the others: grease that was renewed, a seal or a belt that was tightened, a cold morning."""

    name = "friction_change"
    equation = "tau = dFv qd + dFc sign(qd) in some logs"
    looks_like = "residual in proportion to speed, and a step wherever it changes sign, in some logs alone"
    tied_with = ("warmup", "viscous and coulomb, exactly where all logs have it")
    separate_by = "the same motion in logs before and after"
    source = "Simoni, Beschi, Legnani & Visioli 2017"
    options = {"logs": "the logs that have it, by their names under `data`"}

    needs_logs = True
    dFv = Linear("N m s/rad", says="what the viscous coefficient is more there")
    dFc = Linear("N m", says="what Coulomb friction is more there")

    def variants(self, robot, joint):
        """None: in all logs it is what every joint has."""
        return []

    def columns(self, motion, joint):
        there = float(self.present(motion))
        return there * np.stack([motion.qd[:, joint], motion.direction(joint)])
