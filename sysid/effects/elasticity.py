"""A joint that gives."""

import numpy as np

from ..deflection import Deflection
from ..effect_parameters import Shape
from ..two_masses import sprung


class Elasticity(Deflection):
    """A harmonic drive or belt is a damped spring between motor and link: under load they stand at different angles, and the link rings."""

    name = "elasticity"
    equation = "q_link = q_motor - d, M d'' + K (2 damping / omega d' + d) = tau_load, K = 1/compliance, omega = sqrt(K/M)"
    looks_like = "residual in proportion to the second derivative of the torque; ringing at the link's resonance"
    tied_with = ("delay", "current_lag", "encoder_eccentricity", "backlash")
    separate_by = "a chirp past the resonance, or the output locked and the motor pushing"
    maneuvers = ("chirp",)
    source = "Spong 1987"

    compliance = Shape("rad/(N m)", 0.0, 0.1, of="softness", start=0.0, says="angle that the joint gives per torque")
    damping = Shape("1", 0.02, 0.7, says="of the link on its spring, as a share of the critical one (encoder: motor)")

    def shapes(self):
        return (self.compliance, self.damping) if self.encoder == "motor" else (self.compliance,)

    def behind(self, load, inertia, step, compliance, damping=0.0):
        return sprung(load, inertia, step, compliance=compliance, damping=damping)

    def flights(self, bounds):
        # neighbours' resonances lie an eighth apart, within the width of a well damped one
        most, (low, high) = bounds["compliance"][1], bounds["damping"]
        return [{"compliance": float(c), "damping": float(np.clip(0.25, low, high))} for c in np.geomspace(most / 300.0, most, 24)]
