"""A joint that gives."""

from ..effect import MotionEffect, Shape, deflected, one_of, rates


class Elasticity(MotionEffect):
    """A harmonic drive or belt is a spring between motor and link: under load they stand at different angles.

    Valid for motion well below the resonance that the spring makes with the link.
    """

    name = "elasticity"
    equation = "q_link = q_motor - compliance tau_load, compliance = 1/K"
    looks_like = "residual in proportion to the second derivative of the torque"
    tied_with = ("delay", "current_lag", "encoder_eccentricity", "backlash")
    separate_by = "a chirp past the resonance, or the output locked and the motor pushing"
    source = "Spong 1987"
    options = {"encoder": "motor where the encoder turns with the motor, joint where it turns with the link (default motor)"}
    reach = 4
    uses_load = True

    encoder = "motor"
    compliance = Shape("rad/(N m)", 0.0, 0.02, start=0.0, says="angle that the joint gives per torque")

    def given(self, **options):
        chosen = super().given(**options)
        one_of(chosen, "encoder", ("motor", "joint"))
        return chosen

    def variants(self, robot, joint):
        return [{"encoder": "motor"}, {"encoder": "joint"}]

    def moved(self, motion, joint, compliance):
        return deflected(motion, joint, compliance * rates(motion.load[:, joint], motion.step), self.encoder)
