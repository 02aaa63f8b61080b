"""An encoder whose zero is not the URDF's."""

from dataclasses import replace

import numpy as np

from ..effect import MotionEffect
from ..effect_options import subsets, texts
from ..effect_parameters import Shape


class EncoderOffset(MotionEffect):
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

    either_way = True
    logs = None
    d = Shape("rad", -0.5, 0.5, start=0.0, says="true angle less the measured one")

    def given(self, **options):
        chosen = super().given(**options)
        texts(chosen, "logs")
        return chosen

    @property
    def instantaneous(self):
        return self.logs is None

    def among(self, logs):
        return subsets(logs, half=self.either_way)

    def present(self, motion):
        return self.logs is None or motion.source in self.logs

    def moved(self, motion, joint, d):
        if not self.present(motion):
            return motion
        q = np.array(motion.q)
        q[:, joint] += d
        return replace(motion, q=q)
