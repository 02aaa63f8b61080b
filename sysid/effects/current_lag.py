"""A current loop that follows late."""

import numpy as np

from ..effect import SensorEffect
from ..effect_parameters import Shape
from ..smoother import rate

_HALF = 0.02  # s: makes half a per cent too little of 10 Hz and 7 % of 20 Hz, where a motion has hardly any torque and noise most of its rate
_DEGREE = 4


class CurrentLag(SensorEffect):
    """The torque that acts is the commanded or logged one through the current loop's low-pass of time constant T.

    The rate of the torque is that of a polynomial fitted to 20 ms on either side, to two samples at least and `reach` at most (Savitzky &
    Golay 1964): differences of neighbours make most of the angles' noise, and that would pull T towards zero.
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
        half = min(max(_DEGREE // 2, round(_HALF / step)), self.reach, (n - 1) // 2)
        if 2 * half < _DEGREE:
            return torque + T * np.gradient(torque, step, axis=-1)
        return torque + T * rate(torque, step, half, _DEGREE)
