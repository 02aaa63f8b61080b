"""A current loop that follows late."""

import numpy as np

from ..effect import SensorEffect
from ..effect_parameters import Shape
from ..smoother import rate

_DEGREE = 4


class CurrentLag(SensorEffect):
    """The torque that acts is the commanded or logged one through the current loop's low-pass of time constant T.

    The rate of the torque is that of a polynomial fitted to one time constant on either side, to two samples at least and `reach` at most
    (Savitzky & Golay 1964), which makes half a per cent too little of it at 1.3 times the loop's corner, and 7 % at 2.5 times. A loop
    passes little of what is faster, and of differences of neighbours the angles' noise makes most, which would pull T towards zero.
    """

    name = "current_lag"
    equation = "T tau' + tau = tau_measured"
    looks_like = "residual in proportion to the rate of the torque"
    tied_with = ("delay", "elasticity")
    separate_by = "steps or a random binary torque: a lag rounds them, a delay moves them"
    maneuvers = ("chirp",)
    source = "first-order lag; no reference"
    reach = 64

    T = Shape("s", 0.0, 0.05, start=0.0, says="time constant of the current loop")

    def sensed(self, torque, step, T):
        n = torque.shape[-1]
        if n < 2 or not T:
            return torque
        most = min(self.reach, (n - 1) // 2)
        if 2 * most < _DEGREE:
            return torque + T * np.gradient(torque, step, axis=-1)
        half = float(np.clip(T / step, _DEGREE // 2, most))
        return torque + T * rate(torque, step, half, _DEGREE)
