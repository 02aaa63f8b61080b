"""What one model at its parameters makes of one motion, computed once for all who ask."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from . import rows as row
from .model import Model
from .motion import Motion


@dataclass(frozen=True)
class Source:
    """One motion under one model at parameters x (size,): what candidates make their columns of.

    use: (n, dof) bool of the rows that a stride keeps.
    """

    model: Model
    x: np.ndarray
    motion: Motion
    stride: int
    use: np.ndarray

    @cached_property
    def pieces(self) -> list:
        """Whole pieces as effects see them: under the load of the bodies found, not the URDF's."""
        return row.seen(self.referenced, self.motion)

    @cached_property
    def referenced(self) -> Model:
        """The model with bodies that effects of the load look at: its own, or those of x."""
        if self.model.reference is not None:
            return self.model
        return self.model.with_reference(self.x[: 10 * self.model.bodies].reshape(-1, 10))

    @cached_property
    def _bent(self) -> dict:
        return {}

    def bent(self, joint: int) -> list:
        """What a joint's link would change if it stood apart from its motor: the same for whatever
        parts them."""
        if joint not in self._bent:
            self._bent[joint] = row.bent(self.model, self.motion, self.x, joint)
        return self._bent[joint]

    @cached_property
    def _flights(self) -> dict:
        return {}

    def flights(self, key, effect, tries: list[list[dict]]) -> list[list]:
        """How far each joint's link stands apart, of each piece (tried, 3, n), at sets of shape values
        that are tried on each joint: all links at once, once for all who ask with a `key`."""
        if key not in self._flights:
            bent = [self.bent(joint) for joint in range(len(tries))]
            pieces = []
            for k in range(len(self.motion.pieces)):
                cases = [(b[k].load, b[k].inertia, b[k].seen, s) for b, own in zip(bent, tries) for s in own]
                found = iter(effect.several(cases))
                pieces.append([[next(found) for _ in own] for own in tries])
            self._flights[key] = [[piece[joint] for piece in pieces] for joint in range(len(tries))]
        return self._flights[key]

    @cached_property
    def predicted(self) -> np.ndarray:
        """Torque (n, dof), low-passed as the columns are."""
        return row.predicted(self.model, self.motion, self.x, self.stride)

    @cached_property
    def unfiltered(self) -> list[np.ndarray]:
        """Torque (dof, n) over whole pieces, before the low-pass."""
        bodies, rest = np.split(self.x, [10 * self.model.bodies])
        whole = (replace(p, smoother=None, core=slice(0, len(p.t))) for p in self.motion.pieces)
        return [self.model.torque(piece, bodies.reshape(-1, 10), rest).T for piece in whole]

    def full(self, columns: np.ndarray) -> np.ndarray:
        """The model's columns with the slopes of its free shape values after them."""
        slopes = row.tangents(
            self.model, self.motion, self.x, self.stride, self.use, self.predicted
        )
        free = [k for k, value in enumerate(self.model.shape_values) if not value.held]
        return np.concatenate([columns, slopes[:, :, free]], axis=2)
