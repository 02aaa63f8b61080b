"""Play between motor and link."""

import numpy as np

from ..deflection import Deflection
from ..effect_parameters import Shape
from ..two_masses import flown, played

_MANY = 16  # links from which on a step of all at once is faster than one after another


class Backlash(Deflection):
    """Teeth have play: the link lies half of it behind the motor or ahead of it, whichever way the load presses, and flies between.

    Where the encoder turns with the link, the link does not fly: it is the motor that crosses the play.
    """

    name = "backlash"
    equation = "q_link = q_motor - d, M d'' = tau_load while |d| < b/2, then teeth; where motion is slow d = b/2 sign(tau_load)"
    looks_like = "no torque, then a blow, where the load torque changes sign"
    tied_with = ("presliding", "elasticity", "coulomb")
    separate_by = "the same motion in a pose that preloads the gear and in one that balances it"
    maneuvers = ("reversals",)
    source = "Nordin & Gutman 2002"
    blows = True

    b = Shape("rad", 0.0, 0.05, of="angle", start=0.0, says="width of the play")
    teeth = Shape("Hz", 15.0, 80.0, grid=3, says="what the link swings at where the teeth touch (encoder: motor)")
    soft = Shape("N m", 0.003, 0.3, of="torque", says="load torque over which the motor crosses the play (encoder: joint)")

    def shapes(self):
        return (self.b, self.teeth if self.encoder == "motor" else self.soft)

    def behind(self, load, inertia, step, b, teeth=None, soft=None):
        if self.encoder == "joint":
            return 0.5 * b * np.tanh(load / soft)
        return played(load, inertia, step, b=b, teeth=teeth)

    def links(self, cases):
        if self.encoder == "joint":
            return super().links(cases)
        alike: dict[tuple, list[int]] = {}
        for number, (load, _, step, _) in enumerate(cases):
            alike.setdefault((len(load), step), []).append(number)
        out = [None] * len(cases)
        for (_, step), numbers in alike.items():
            own = [cases[number] for number in numbers]
            for number, behind in zip(numbers, super().links(own) if len(own) < _MANY else _together(own, step)):
                out[number] = behind
        return out

    def flights(self, bounds):
        # the time of flight grows with the cube root of the play: neighbours' are a sixth apart
        most, (low, high) = bounds["b"][1], bounds["teeth"]
        return [{"b": float(b), "teeth": float(np.sqrt(low * high))} for b in np.geomspace(most / 500.0, most, 14)]


def _together(cases: list[tuple], step: float) -> np.ndarray:
    """`behind` (links, n) of links on logs of the same length."""
    load, inertia, _, shapes = zip(*cases)
    return flown(load, inertia, step, **{word: [own[word] for own in shapes] for word in ("b", "teeth")})
