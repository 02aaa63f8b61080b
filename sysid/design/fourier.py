"""Sums of harmonics that begin and end at rest.

    q_j(t) = c_j + sum_k a_jk sin(k w t) + b_jk cos(k w t),      k = 1 .. harmonics,

with w = 2 pi rounds / duration, so that a motion ends where it begins. Speed and acceleration are
zero there where sum_k k a_jk = 0 and sum_k k^2 b_jk = 0: the free coordinates z of each joint are a
basis of what these two leave.

Source: Swevers, Ganseman, De Schutter & Van Brussel 1997 (harmonics); the ends at rest: elementary.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import null_space


@dataclass(frozen=True)
class Fourier:
    """A family of motions. duration [s]; harmonics a joint; rounds of the slowest one in the
    duration."""

    duration: float
    harmonics: int
    rounds: int
    dof: int

    @property
    def size(self) -> int:
        """Free coordinates of each joint."""
        return 2 * self.harmonics - 1

    @cached_property
    def _free(self) -> np.ndarray:
        """(1 + 2 harmonics, size): coefficients (c, a, b) of coordinates z. A unit of any moves the
        joint by a radian or so at most, whatever the harmonic: high ones are divided by their
        order."""
        k = np.arange(1, self.harmonics + 1)
        ends = np.zeros((2, 2 * self.harmonics))
        ends[0, : self.harmonics], ends[1, self.harmonics :] = k, k**2
        scale = np.concatenate([1.0 / k, 1.0 / k])
        waves = scale[:, None] * null_space(ends * scale)
        out = np.zeros((1 + 2 * self.harmonics, self.size))
        out[0, 0], out[1:, 1:] = 1.0, waves
        return out

    def basis(self, t) -> np.ndarray:
        """(4, n, size): what z of a joint gives of q, qd, qdd and jerk at times t (n,)."""
        w = 2.0 * np.pi * self.rounds / self.duration * np.arange(1, self.harmonics + 1)
        angle = np.asarray(t)[:, None] * w
        sine, cosine, zero = np.sin(angle), np.cos(angle), np.zeros((len(angle), 1))
        rows = [
            np.hstack([zero + 1.0, sine, cosine]),
            np.hstack([zero, w * cosine, -w * sine]),
            np.hstack([zero, -(w**2) * sine, -(w**2) * cosine]),
            np.hstack([zero, -(w**3) * cosine, w**3 * sine]),
        ]
        return np.stack(rows) @ self._free

    def coefficients(self, z) -> np.ndarray:
        """(dof, 1 + 2 harmonics) c, a, b of coordinates z (dof, size)."""
        return z @ self._free.T

    def motion(self, z, t) -> np.ndarray:
        """q, qd, qdd, jerk (4, n, dof) of coordinates z (dof, size) at times t (n,)."""
        return self.basis(t) @ z.T
