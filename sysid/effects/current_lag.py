"""A current loop that follows late."""

import numpy as np

from ..effect import SensorEffect
from ..effect_parameters import Shape
from ..smoother import rate

_HALF = 1.0  # time constants: makes half a per cent too little of the rate at 1.3 times the loop's corner, 7 % at 2.5 times
_DEGREE = 4


class CurrentLag(SensorEffect):
    """The torque that acts is the commanded or logged one through the current loop's low-pass of time constant T.

    The rate of the torque is that of a polynomial fitted to one time constant on either side, to two samples at least and `reach` at most
    (Savitzky & Golay 1964): a loop passes little of what is faster, and of differences of neighbours the angles' noise makes most, which
    would pull T towards zero.
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
        # between two whole numbers of samples a mean of both: what is fitted to T may not jump
        half = float(np.clip(_HALF * T / step, _DEGREE // 2, most))
        lower = min(int(half), most - 1) if half > _DEGREE // 2 else _DEGREE // 2
        slope = rate(torque, step, lower, _DEGREE)
        if half > lower:
            slope += (half - lower) * (rate(torque, step, lower + 1, _DEGREE) - slope)
        return torque + T * slope
