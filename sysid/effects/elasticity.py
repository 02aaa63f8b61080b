"""A joint that gives."""

from ..effect import Deflection, Shape, rates


class Elasticity(Deflection):
    """A harmonic drive or belt is a spring between motor and link: under load they stand at different angles.

    Valid for motion well below the resonance that the spring makes with the link.
    """

    name = "elasticity"
    equation = "q_link = q_motor - compliance tau_load, compliance = 1/K"
    looks_like = "residual in proportion to the second derivative of the torque"
    tied_with = ("delay", "current_lag", "encoder_eccentricity", "backlash")
    separate_by = "a chirp past the resonance, or the output locked and the motor pushing"
    source = "Spong 1987"

    compliance = Shape("rad/(N m)", 0.0, 0.02, start=0.0, says="angle that the joint gives per torque")

    def behind(self, load, step, compliance):
        return compliance * rates(load, step)
