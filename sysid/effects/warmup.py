"""Friction that changes as the joint warms up."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_parameters import Linear, Shape, called
from ..errors import ConfigError


class Warmup(TorqueEffect):
    """Grease gets thinner as it warms, so that friction falls over minutes, or follows a logged temperature.

    With a logged temperature x [deg C] the coefficients are what 20 degrees above 20 deg C add. Without one they are
    what the start of the log's clock had more than its end, and neither less: friction that was higher at low speed and lower
    at high speed is what a joint has that breaks away, and no grease.
    """

    name = "warmup"
    equation = "tau = (dFv qd + dFc sign(qd)) exp(-t/T); with a signal x, (dFv qd + dFc sign(qd)) (x - 20)/20"
    looks_like = "friction that falls over minutes"
    tied_with = ("viscous", "coulomb", "sublinear_viscous")
    separate_by = "the same motion cold and warm, or a logged temperature"
    source = "Simoni, Beschi, Legnani & Visioli 2017"
    options = {"signal": "the logged signal that is the joint's temperature [deg C]; without it, an exponential of time"}

    instantaneous = False  # the clock's or a thermometer's
    signal = None
    dFv = Linear("N m s/rad", says="change of the viscous coefficient")
    dFc = Linear("N m", says="change of Coulomb friction")
    # quicker than a fifth of the log is no warmth, but what its start was like
    T = Shape("s", 0.2, 2.0, of="duration", says="time constant of warming up")

    def given(self, **options):
        chosen = super().given(**options)
        if not (chosen.signal is None or isinstance(chosen.signal, str)):
            raise ConfigError(f"warmup.signal is {chosen.signal!r}", where="model.effects", allowed="the name of a logged signal")
        return chosen

    def coefficients(self):
        lower = None if self.signal else 0
        return tuple(called(Linear(c.unit, lower=lower, says=c.says), c.name) for c in super().coefficients())

    def shapes(self):
        return () if self.signal else (type(self).T,)

    def columns(self, motion, joint, T=None):
        if self.signal is None:
            factor = np.exp(-motion.t / T)
        elif self.signal in motion.signals:
            factor = (motion.signals[self.signal] - 20.0) / 20.0
        else:
            logged = ", ".join(motion.signals) or "none is; data.signals names them"
            raise ConfigError(f"warmup.signal {self.signal!r} is not logged", where="model.effects", allowed=logged)
        return np.stack([motion.qd[:, joint] * factor, motion.direction(joint) * factor])
