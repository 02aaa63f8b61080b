"""Effects by which the joint is not where its encoder says: what the load bends or lets go."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from typing import ClassVar

import numpy as np

from .effect import MotionEffect
from .effect_options import one_of
from .motion import Piece


class Deflection(MotionEffect):
    """An effect by which a joint's link stands behind its motor under load.

    encoder: "motor" where the encoder turns with the motor: the link is behind what was measured;
        "joint" where it turns with the link: the motor is ahead of what was measured.
    blows: the link is stopped by what it strikes.
    """

    options = {"encoder": "motor where the encoder turns with the motor, joint where it turns with the link (default motor)"}
    memory = True
    uses_load = True
    blows: ClassVar[bool] = False

    encoder = "motor"

    def given(self, **options):
        chosen = super().given(**options)
        one_of(chosen, "encoder", ("motor", "joint"))
        return chosen

    def variants(self, robot, joint):
        return [{"encoder": "motor"}, {"encoder": "joint"}]

    @abstractmethod
    def behind(self, load: np.ndarray, inertia: np.ndarray, step: float, **shapes: float) -> np.ndarray:
        """How far (n,) the link stands behind its motor.

        Args:
            load: (n,) what the link would need of its drive did it follow what was measured, every `step` seconds.
            inertia: (n,) of the link about the joint, zero where what was measured is the link.
        """

    def apart(self, load: np.ndarray, inertia: np.ndarray, motion: Piece, **shapes: float) -> np.ndarray:
        """`behind` with its first two derivatives (3, n), as the encoder sees it.

        Of a link that is measured nothing is left to move by itself. The load is that of angles seen through a filter: what is
        linear in it has been seen through it too, and blows, which are not, must be, as the motor's answer to them was.
        """
        (one,) = self.several([(load, inertia, motion, shapes)])
        return one

    def several(self, cases: list[tuple]) -> list[np.ndarray]:
        """`apart` of several links: (load, inertia, motion, shapes) each."""
        motor = self.encoder == "motor"
        behind = self.links([(load, inertia if motor else 0.0 * inertia, motion.step, shapes) for load, inertia, motion, shapes in cases])
        return [
            motion.sight.rates(own) if self.blows and motion.sight is not None and len(own) > 1 else rates(own, motion.step)
            for own, (_, _, motion, _) in zip(behind, cases)
        ]

    def links(self, cases: list[tuple]) -> list[np.ndarray]:
        """`behind` of several links: (load, inertia, step, shapes) each."""
        return [self.behind(load, inertia, step, **shapes) for load, inertia, step, shapes in cases]

    def tries(self, bounds):
        return self.flights(bounds) if self.encoder == "motor" else []

    def flights(self, bounds: dict[str, tuple[float, float]]) -> list[dict[str, float]]:
        """`tries` of a link that moves by itself."""
        return []

    def moved(self, motion, joint, *, behind=None, **shapes):
        """As `MotionEffect.moved`.

        Args:
            behind: (3, n) `apart` on these rows, which looks back to the start of the log; None: without the link's inertia.
        """
        if behind is None:
            load = motion.load[:, joint]
            behind = self.apart(load, 0.0 * load, motion, **shapes)
        deflection = np.zeros((3, *motion.q.shape)) if motion.deflection is None else motion.deflection.copy()
        deflection[:, :, joint] += behind
        if self.encoder == "motor":
            return replace(motion, deflection=deflection)
        ahead = [np.array(x) for x in (motion.q, motion.qd, motion.qdd)]
        for values, own in zip(ahead, behind):
            values[:, joint] += own
        return replace(motion, q=ahead[0], qd=ahead[1], qdd=ahead[2], deflection=deflection)


def rates(values: np.ndarray, step: float) -> np.ndarray:
    """Values (n,) sampled every `step` seconds with their first two derivatives (3, n), by central differences."""
    if len(values) < 3:
        return np.stack([values, np.zeros(len(values)), np.zeros(len(values))])
    second = np.diff(values, 2) / step**2
    return np.stack([values, np.gradient(values, step), np.concatenate([second[:1], second, second[-1:]])])
