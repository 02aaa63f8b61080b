"""A wrong torque constant."""

from ..effect import SensorEffect
from ..effect_parameters import Shape


class TorqueGain(SensorEffect):
    """The torque signal of one joint is too large by a factor: a torque constant, gear ratio or amplifier other than stated."""

    name = "torque_gain"
    equation = "tau_measured = (1 + e) tau"
    looks_like = "residual in proportion to the torque itself; invisible where all joints share it"
    tied_with = ("load_friction", "torque_saturation", "masses, exactly where all joints share the gain")
    separate_by = "a payload of known mass"
    source = "Gautier & Briot 2014"
    mimics_mass = True
    constant_gain = True

    e = Shape("1", -0.6, 1.5, start=0.0, says="share by which the signal is too large")

    def sensed(self, torque, step, e):
        return (1.0 + e) * torque
