"""An encoder whose zero is not the URDF's."""

from dataclasses import replace

import numpy as np

from ..effect import MotionEffect
from ..effect_parameters import Shape
from ..in_logs import InLogs


class EncoderOffset(InLogs, MotionEffect):
    """The joint stands at another angle than the encoder says, by a constant; in all logs, or in some since its zero was set anew."""

    name = "encoder_offset"
    equation = "q -> q + d"
    looks_like = "residual like the change of torque with the angle: gravity turned in the pose"
    tied_with = ("centre of mass of the links behind it", "gravity_tilt")
    separate_by = "static poses over the full range of several joints"
    maneuvers = ("poses",)
    source = "elementary; no reference"
    simulators = {"zero": "d"}
    options = {"logs": "the logs that have it, by their names under `data` (default: all)"}

    d = Shape("rad", -0.5, 0.5, start=0.0, says="true angle less the measured one")

    def moved(self, motion, joint, d):
        if not self.present(motion):
            return motion
        q = np.array(motion.q)
        q[:, joint] += d
        return replace(motion, q=q)
