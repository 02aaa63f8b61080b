"""Play between motor and link."""

import numpy as np

from ..effect import MotionEffect, Shape, deflected, one_of, rates


class Backlash(MotionEffect):
    """Teeth have play: the link lies half of it behind the motor or ahead of it, whichever way the load presses."""

    name = "backlash"
    equation = "q_link = q_motor - b/2 tanh(tau_load/soft)"
    looks_like = "impulses where the load torque changes sign"
    tied_with = ("presliding", "elasticity", "coulomb")
    separate_by = "the same motion in a pose that preloads the gear and in one that balances it"
    source = "Nordin & Gutman 2002"
    options = {"encoder": "motor where the encoder turns with the motor, joint where it turns with the link (default motor)"}
    reach = 4
    uses_load = True

    encoder = "motor"
    b = Shape("rad", 0.0, 0.1, start=0.0, says="width of the play")
    soft = Shape("N m", 0.01, 0.3, of="torque", says="load torque over which the link crosses the play")

    def given(self, **options):
        chosen = super().given(**options)
        one_of(chosen, "encoder", ("motor", "joint"))
        return chosen

    def variants(self, robot, joint):
        return [{"encoder": "motor"}, {"encoder": "joint"}]

    def moved(self, motion, joint, b, soft):
        return deflected(motion, joint, rates(0.5 * b * np.tanh(motion.load[:, joint] / soft), motion.step), self.encoder)
