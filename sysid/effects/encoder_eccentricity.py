"""An encoder disc off its centre."""

from dataclasses import replace

import numpy as np

from ..effect import MotionEffect
from ..effect_parameters import Shape


class EncoderEccentricity(MotionEffect):
    """A disc that sits off its centre reads an angle that errs once per turn, and speed and acceleration with it.

    The error is d sin(q + phi) with d = hypot(s, c) and phi = atan2(c, s).
    """

    name = "encoder_eccentricity"
    equation = "q -> q + s sin(q) + c cos(q)"
    looks_like = "residual once per turn, that grows with the speed"
    tied_with = ("encoder_offset", "cogging")
    separate_by = "constant speeds over a full turn, with another encoder to compare"
    maneuvers = ("ladder",)
    source = "elementary; no reference"

    s = Shape("rad", -0.2, 0.2, start=0.0, says="sine of the error")
    c = Shape("rad", -0.2, 0.2, start=0.0, says="cosine of the error")

    def moved(self, motion, joint, s, c):
        q, qd, qdd = (np.array(x) for x in (motion.q, motion.qd, motion.qdd))
        angle, speed, push = q[:, joint].copy(), qd[:, joint].copy(), qdd[:, joint].copy()
        slope = s * np.cos(angle) - c * np.sin(angle)
        bend = s * np.sin(angle) + c * np.cos(angle)
        q[:, joint] = angle + bend
        qd[:, joint] = speed + slope * speed
        qdd[:, joint] = push + slope * push - bend * speed**2
        return replace(motion, q=q, qd=qd, qdd=qdd)
