"""A current loop that follows late."""

import numpy as np

from ..effect import SensorEffect
from ..effect_parameters import Shape


class CurrentLag(SensorEffect):
    """The torque that acts is the commanded or logged one through the current loop's low-pass of time constant T."""

    name = "current_lag"
    equation = "T tau' + tau = tau_measured"
    looks_like = "residual in proportion to the rate of the torque"
    tied_with = ("delay", "elasticity")
    separate_by = "steps or a random binary torque: a lag rounds them, a delay moves them"
    maneuvers = ("chirp",)
    source = "first-order lag; no reference"
    reach = 2

    T = Shape("s", 0.0, 0.05, start=0.0, says="time constant of the current loop")

    def sensed(self, torque, step, T):
        if torque.shape[-1] < 2:
            return torque
        rate = np.gradient(torque, step, axis=-1)
        # two neighbours make 6 % too little of 10 Hz at 100 Hz, which a delay has in full
        far, near = torque[..., 4:] - torque[..., :-4], torque[..., 3:-1] - torque[..., 1:-3]
        rate[..., 2:-2] = (8.0 * near - far) / (12.0 * step)
        return torque + T * rate
