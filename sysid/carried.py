"""Bodies among the coefficients of effects: a payload that some logs carry.

Their ten columns are as linear as a link's, and they have to be as possible. So the solver is handed
them beside the robot's bodies, and parameters go back to their place in the model. What is believed
of such a body is next to nothing, and the same whatever the robot's prior weighs (but for none: then
it has none either): it keeps the body possible where the data would not, and says what they do not
tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .inertia import pseudo
from .inertia.consistency import is_consistent
from .inertia.divergence import Scaled
from .model_parameters import Coefficient
from .objective import Objective
from .solve import Coordinates

BALL = pseudo.sphere(1.0, np.zeros(3), 0.05)  # a kilogram at the link's own frame
WEAK = 1e-2  # of the noise's square: the weight of this prior
LEAST = 1e-10  # and of the robot's prior's: of less double precision finds no optimum of both


@dataclass(frozen=True)
class Carried:
    """places: (bodies, 10) where their parameters stand in x; weight: of their prior [N^2 m^2]."""

    places: np.ndarray
    weight: float

    def _order(self, size: int, count: int) -> np.ndarray:
        """The robot's `count` parameters, these, then the rest of x (size,)."""
        rest = np.setdiff1d(np.arange(count, size), self.places)
        return np.concatenate([np.arange(count), self.places.ravel(), rest])

    def handed(self, objective: Objective, coordinates: Coordinates):
        """Objective and coordinates in which these are bodies, and their order: x[order] is what
        the solver calls x."""
        count, more = 10 * objective.bodies, len(self.places)
        size = objective.triangle.shape[1] - 1
        order = self._order(size, count)
        own = objective.divergence
        divergence = type(own)(np.concatenate([own.prior, np.tile(BALL, (more, 1))]))
        if objective.weight > 0.0:
            ratio = max(self.weight / objective.weight, LEAST)
            scale = np.concatenate([np.ones(objective.bodies), np.full(more, ratio)])
            divergence = Scaled(divergence, scale)
        known = objective.known
        if known is not None:
            known = np.concatenate([known, np.zeros((more, 10, 10))])
        left = order[count + 10 * more :] - count
        return (
            replace(
                objective, triangle=objective.triangle[:, np.append(order, size)],
                divergence=divergence, known=known,
            ),
            replace(
                coordinates, bodies=objective.bodies + more,
                positive=coordinates.positive[left], held=coordinates.held[left],
            ),
            order,
        )  # fmt: skip

    def possible(self, x: np.ndarray) -> np.ndarray:
        """x (size,) with the ball in the place of what is no possible body."""
        out = np.array(x, dtype=float)
        for own in self.places:
            out[own] = out[own] if is_consistent(out[own]) else BALL
        return out


def places_of(coefficients: Sequence[Coefficient], count: int) -> np.ndarray:
    """(bodies, 10) where the parameters of effects' bodies stand after the robot's `count`."""
    own = [count + k for k, one in enumerate(coefficients) if one.of_body]
    return np.array(own, dtype=int).reshape(-1, 10)
