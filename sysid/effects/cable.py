"""Cables and hoses along the arm."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_options import whole
from ..effect_parameters import Linear, called


class Cable(TorqueEffect):
    """A dress pack bends and twists with the joint: torque that is a smooth function of the angle."""

    name = "cable"
    equation = "tau = sum_i c_i (q/pi)^i, i from 1"
    looks_like = "residual that is smooth in the angle"
    tied_with = ("spring", "cogging", "position_friction", "gravity")
    separate_by = "static scans both ways, with and without the cable"
    maneuvers = ("ladder",)
    source = "a polynomial fit; no reference"
    elementwise = True
    options = {"order": "highest power of the angle, from 1 (default 5)"}

    nested = ("order",)

    order = 5

    def given(self, **options):
        chosen = super().given(**options)
        whole(chosen, "order", 9)
        return chosen

    def variants(self, robot, joint):
        return [{"order": 3}, {}]

    def richer(self, **shapes):
        return [({"order": type(self).order}, {})] if self.order < type(self).order else []

    def coefficients(self):
        return tuple(called(Linear("N m", says=f"power {i} of the half turn"), f"c{i}") for i in range(1, self.order + 1))

    def columns(self, motion, joint):
        return (motion.q[:, joint] / np.pi) ** np.arange(1, self.order + 1)[:, None]
