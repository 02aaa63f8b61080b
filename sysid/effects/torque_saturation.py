"""A torque signal that bends at large torque."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_parameters import Linear, Shape


class TorqueSaturation(TorqueEffect):
    """Iron saturates, so that current rises faster than torque (e > 0); a sensor or amplifier that clips reads less (e = -1)."""

    name = "torque_saturation"
    equation = "tau = e sign(tau_needed) max(|tau_needed| - limit, 0)"
    looks_like = "flat or sharpened tops of the torque: residual like the cube of the torque"
    tied_with = ("torque_gain", "load_friction")
    separate_by = "a ladder of static torques up to the largest"
    maneuvers = ("poses",)
    source = "the magnetisation curve of a motor's iron; no reference"
    uses_load = True
    uses_needed = True

    e = Linear("1", says="share of the torque beyond the limit that the signal shows too much; -1 reads flat")
    limit = Shape("N m", 0.3, 1.0, of="torque", says="torque, of bodies and all other effects, beyond which the signal bends")

    def columns(self, motion, joint, limit):
        # the bodies' alone where nobody knows the rest
        needed = (motion.load if motion.needed is None else motion.needed)[:, joint]
        return (np.sign(needed) * np.maximum(np.abs(needed) - limit, 0.0))[None]
