"""Play between motor and link."""

import numpy as np

from ..effect import Deflection, Shape, rates


class Backlash(Deflection):
    """Teeth have play: the link lies half of it behind the motor or ahead of it, whichever way the load presses."""

    name = "backlash"
    equation = "q_link = q_motor - b/2 tanh(tau_load/soft)"
    looks_like = "impulses where the load torque changes sign"
    tied_with = ("presliding", "elasticity", "coulomb")
    separate_by = "the same motion in a pose that preloads the gear and in one that balances it"
    source = "Nordin & Gutman 2002"

    b = Shape("rad", 0.0, 0.1, start=0.0, says="width of the play")
    soft = Shape("N m", 0.01, 0.3, of="torque", says="load torque over which the link crosses the play")

    def behind(self, load, step, b, soft):
        return rates(0.5 * b * np.tanh(load / soft), step)
