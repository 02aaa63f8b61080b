"""What has a model and its parameters also has the torque that they need."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from .inverse_dynamics import NOWHERE, InverseDynamics, inverse_dynamics
from .model import Model


class WithTorque:
    """What has a model and its parameters x (size,) also has the torque that they need."""

    model: Model
    x: np.ndarray

    @cached_property
    def _made(self) -> dict[tuple, InverseDynamics]:
        return {}

    def inverse_dynamics_at(self, levels: Mapping[str, str]) -> InverseDynamics:
        """What `torque` computes with at {group: level}; made when it is first used. Threads need
        one each."""
        key = tuple(sorted(levels.items()))
        if key not in self._made:
            self._made[key] = inverse_dynamics(self.model, self.x, levels)
        return self._made[key]

    @property
    def inverse_dynamics(self) -> InverseDynamics:
        """`inverse_dynamics_at` of a model without effects per group."""
        return self.inverse_dynamics_at(NOWHERE)

    def torque(self, q, qd, qdd, *, levels: Mapping[str, str] = NOWHERE) -> np.ndarray:
        """Torque [N m or N] of one sample (dof,) or many (n, dof), bodies, rotors and every effect
        that looks at one instant.

        Args:
            q, qd, qdd: positions [rad or m], velocities and accelerations, in the order of
                `joints`.
            levels: {group: level} of every group of logs that effects are per.

        Effects that look back in time, at the clock or at logged signals (presliding, backlash,
        elasticity, delay, current_lag, external_force, warmup) are left out; `omitted` names those
        of this model.

        Raises:
            SysidError: shapes that are neither, or not alike; a level that is not said, or not
                there.
        """
        return self.inverse_dynamics_at(levels)(q, qd, qdd)

    @property
    def omitted(self) -> tuple[str, ...]:
        """The effects of the model that `torque` leaves out, as `effect.joint`."""
        groups = self.model.groups
        most = max(map(len, groups.values()), default=1)  # each level of each group once
        every = [{g: own[min(k, len(own) - 1)] for g, own in groups.items()} for k in range(most)]
        left = (name for own in every for name in self.inverse_dynamics_at(own).omitted)
        return tuple(dict.fromkeys(left))
