"""Torque ripple over the angle."""

from dataclasses import replace

import numpy as np

from ..effect import TorqueEffect
from ..effect_options import whole
from ..effect_parameters import Linear, Shape, called

_FINEST = 1e-3  # m, the pitch of a screw: less is none that drives a joint
_EVEN = 1e-12  # of the grid's width: as even as rounding leaves it


class Cogging(TorqueEffect):
    """Magnets prefer the iron's teeth, and gears their mesh: torque that repeats with the angle, whatever the speed.

    On a joint that carries weight a ripple of k = 1 is gravity itself and cannot be seen. On a prismatic joint k
    counts per metre, and is looked for from two periods over the travel up to a pitch of 1 mm, or 120 periods over it;
    over a long travel up to a pitch of 52 mm.
    """

    name = "cogging"
    equation = "tau = sum_j (a_j sin(j k q) + b_j cos(j k q))"
    looks_like = "lines at the frequency k qd / 2 pi, the same torque at any speed and both ways"
    tied_with = ("spring", "cable", "position_friction", "encoder_eccentricity", "gravity where k is 1")
    separate_by = "a slow scan both ways over several periods"
    maneuvers = ("ladder",)
    source = "Holtz 1996"
    elementwise = True
    options = {"lines": "how many multiples of k, from 1 (default 1)"}

    lines = 1
    sliding = ()
    _most, _under = 8, 4  # lines; a part of k that may be the pitch, of which k is a multiple
    k = Shape("1/rad", 1.0, 120.0, grid=480, even=True, spacing=np.pi / 2, says="periods in 2 pi rad")

    def given(self, **options):
        chosen = super().given(**options)
        whole(chosen, "lines", self._most)
        return chosen

    def bound(self, robot, joint):
        bound = self.given()
        bound.sliding = tuple(robot.prismatic.tolist())
        return bound

    def sized(self, motion, rows, joint):
        travel = np.ptp(motion.q[:, joint])
        if not (self.sliding and self.sliding[joint] and travel > 0.0):
            return None
        low = 4.0 * np.pi / travel  # as `Shape.bounds` has it
        high = min(2.0 * np.pi / _FINEST, max(self.k.high, low + self.k.grid * self.k.spacing / travel))
        return (called(replace(self.k, low=low, high=max(low, high)), "k"),)

    def richer(self, **shapes):
        """More multiples of the same pitch, or of one of which the lines that are there are multiples: torque that repeats
        with the angle is seldom one sine."""
        return [
            ({"lines": lines}, {"k": shapes["k"] / part})
            for part in range(1, self._under + 1)
            for lines in range(self.lines * part + (part == 1), self._most + 1)
            if shapes["k"] / part >= self.k.low
        ]

    def coefficients(self):
        part = {"a": "sine", "b": "cosine"}
        return tuple(called(Linear("N m", says=f"{part[word]} of {j} k q"), f"{word}{j}") for j in range(1, self.lines + 1) for word in "ab")

    def columns(self, motion, joint, k):
        angles = np.arange(1, self.lines + 1)[:, None] * k * motion.q[:, joint]
        return np.stack([np.sin(angles), np.cos(angles)], axis=1).reshape(2 * self.lines, -1)

    def columns_at(self, motion, joint, tried):
        k = np.array([shapes["k"] for shapes in tried])
        if self.lines > 1 or len(k) < 3 or np.ptp(np.diff(k)) > _EVEN * np.ptp(k):
            return super().columns_at(motion, joint, tried)
        # each of an even grid is the one before, turned further
        turn, further = (np.exp(1j * by * motion.q[:, joint]) for by in (k[0], (k[-1] - k[0]) / (len(k) - 1)))
        out = np.empty((len(k), 2, len(turn)))
        for own in out:
            own[0], own[1] = turn.imag, turn.real
            turn *= further
        return out
