"""A torque signal that bends at large torque."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_parameters import Linear, Shape


class TorqueSaturation(TorqueEffect):
    """Iron saturates, so that current rises faster than torque (e > 0); a sensor or amplifier that clips reads less (e = -1)."""

    name = "torque_saturation"
    equation = "tau = e sign(tau_load) max(|tau_load| - limit, 0)"
    looks_like = "flat or sharpened tops of the torque: residual like the cube of the torque"
    tied_with = ("torque_gain", "load_friction")
    separate_by = "a ladder of static torques up to the largest"
    maneuvers = ("poses",)
    source = "the magnetisation curve of a motor's iron; no reference"
    uses_load = True
    elementwise = True

    e = Linear("1", says="share of the torque beyond the limit that the signal shows too much; -1 reads flat")
    limit = Shape("N m", 0.3, 0.97, of="torque", says="torque beyond which the signal bends")

    def columns(self, motion, joint, limit):
        load = motion.load[:, joint]
        return (np.sign(load) * np.maximum(np.abs(load) - limit, 0.0))[None]
