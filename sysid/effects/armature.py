"""Armature: the motor's inertia, seen through its gear, as one number."""

from ..effect import TorqueEffect
from ..effect_parameters import Linear


class Armature(TorqueEffect):
    """A geared rotor resists the joint's own acceleration; a model without rotors needs it.

    Valid where the gear ratio is large, so that the rotor's gyroscopic terms and its share of the carrier's
    inertia can be left out.
    """

    name = "armature"
    equation = "tau = Ia qdd"
    looks_like = "residual in proportion to the joint's own acceleration"
    tied_with = ("the link's moment of inertia on a first joint that does not tilt",)
    separate_by = "a chirp in two poses of the joints behind it"
    maneuvers = ("chirp",)
    source = "Featherstone 2008, section 9.6"
    mimics_mass = True
    elementwise = True
    simulators = {"armature": "Ia"}

    Ia = Linear("kg m^2", lower=0, says="rotor inertia times the squared gear ratio")

    def columns(self, motion, joint):
        return motion.qdd[None, :, joint]
