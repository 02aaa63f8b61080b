"""Cubic splines through waypoints, at rest at both ends: the motions that FIGAROH designs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

_BETWEEN = 2.0  # s from waypoint to waypoint, as in FIGAROH's examples


@dataclass(frozen=True)
class Splines:
    """A family of motions, as `sysid.design.fourier.Fourier` is one. duration [s]. Coordinates of a
    joint: where it begins, and how far from there each later waypoint is."""

    duration: float
    dof: int
    maneuvers: tuple = ()

    @property
    def size(self) -> int:
        """Free coordinates of each joint."""
        return 1 + int(round(self.duration / _BETWEEN))

    @property
    def fastest(self) -> float:
        """A frequency [Hz] that no motion is much faster than."""
        return 1.0 / _BETWEEN

    @cached_property
    def _ways(self) -> CubicSpline:
        t = np.linspace(0.0, self.duration, self.size)
        return CubicSpline(t, np.eye(self.size)[:, 1:], bc_type="clamped")

    def basis(self, t) -> np.ndarray:
        """(4, n, size): what coordinates give of q, qd, qdd and jerk at times t (n,)."""
        own = np.stack([self._ways(t, k) for k in range(4)])
        first = np.zeros((4, len(t), 1))
        first[0] = 1.0
        return np.concatenate([first, own], axis=2)

    def motion(self, z, t) -> np.ndarray:
        """q, qd, qdd, jerk (4, n, dof) of coordinates z (dof, size)."""
        return self.basis(np.asarray(t)) @ z.T

    def drawn(self, limits, pose, rng: np.random.Generator) -> np.ndarray:
        """Random waypoints (dof, size) about a pose, each no farther from the last than speeds let it."""
        z = np.zeros((self.dof, self.size))
        z[:, 0] = pose
        most = np.minimum(0.6 * _BETWEEN * limits.velocity, 0.1 * _BETWEEN**2 * limits.acceleration)
        room = 0.8 * limits.half
        for k in range(1, self.size):
            here = z[:, 0] + z[:, k] if k == 1 else z[:, 0] + z[:, k - 1]
            asked = limits.middle + room * rng.uniform(-1.0, 1.0, self.dof)
            z[:, k] = here + np.clip(asked - here, -most, most) - z[:, 0]
        return z
