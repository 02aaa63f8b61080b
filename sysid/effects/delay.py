"""Torque logged late."""

import numpy as np

from ..effect import SensorEffect
from ..effect_parameters import Shape


class Delay(SensorEffect):
    """The torque signal is stamped later (d > 0) or earlier than the angle of the same instant.

    Valid for shifts up to `reach` samples, 0.03 s at 2 kHz; a longer one counts as that.
    """

    name = "delay"
    equation = "tau_measured(t) = tau(t - d)"
    looks_like = "residual in proportion to the rate of the torque, and to the jerk"
    tied_with = ("current_lag", "elasticity")
    separate_by = "motions of several frequencies: a delay turns the phase in proportion to frequency, a lag saturates"
    maneuvers = ("chirp",)
    source = "elementary; no reference"
    reach = 64

    d = Shape("s", -0.03, 0.03, start=0.0, says="how late torque is against the angle")

    def sensed(self, torque, step, d):
        # Lagrange's polynomial through the six samples about each instant: one stencil, as the shift is the same for all
        nodes = np.arange(-2, 4)
        shift = np.clip(-d / step, nodes[-1] - self.reach, self.reach + nodes[0])
        whole = int(np.floor(shift))
        weights = [np.prod([(shift - whole - other) / (node - other) for other in nodes if other != node]) for node in nodes]
        n = torque.shape[-1]
        first, last = max(0, -(whole - 2)), max(0, whole + 3)
        held = np.concatenate([np.repeat(torque[..., :1], first, -1), torque, np.repeat(torque[..., -1:], last, -1)], axis=-1)
        out = np.zeros(torque.shape)
        for node, weight in zip(nodes.tolist(), weights):
            if weight:
                start = first + whole + node
                out += weight * held[..., start : start + n]
        return out
