"""Sums of harmonics that begin and end at rest, and maneuvers after them.

    q_j(t) = c_j + sum_k a_jk sin(k w t) + b_jk cos(k w t),      k = 1 .. harmonics,

with w = 2 pi rounds / their time, so that a motion ends where it begins. Speed and acceleration are
zero there where sum_k k a_jk = 0 and sum_k k^2 b_jk = 0: the free coordinates z of each joint are a
basis of what these two leave. A maneuver starts from where they end: of each, a joint has one more
coordinate, how much of it the joint does.

Source: Swevers, Ganseman, De Schutter & Van Brussel 1997 (harmonics); the ends at rest: elementary.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import null_space

from .maneuvers import Maneuver


@dataclass(frozen=True)
class Fourier:
    """A family of motions. duration [s] with all maneuvers; harmonics a joint; rounds of the slowest
    one in their time; maneuvers, after them and one after another."""

    duration: float
    harmonics: int
    rounds: int
    dof: int
    maneuvers: tuple[Maneuver, ...] = ()

    @property
    def size(self) -> int:
        """Free coordinates of each joint."""
        return 2 * self.harmonics - 1 + len(self.maneuvers)

    @property
    def waves(self) -> int:
        """Those of the pose and of harmonics: maneuvers' come after them."""
        return 2 * self.harmonics - 1

    @property
    def time(self) -> float:
        """What harmonics have of the duration [s]."""
        return self.duration - sum(own.duration for own in self.maneuvers)

    @property
    def fastest(self) -> float:
        """The highest frequency [Hz] of any motion."""
        chirps = (own.fastest for own in self.maneuvers if own.kind == "chirp")
        return max(self.rounds * self.harmonics / self.time, *chirps, 0.0)

    def followed_by(
        self, kinds: Sequence[str], joints: Sequence[int], share: float, fastest: float
    ) -> Fourier:
        """The same with maneuvers of these kinds, which have a share of the time between them.

        Args:
            joints: that begin with them, all where there are none. fastest [Hz]: of a chirp.
        """
        each = share * self.duration / len(kinds)
        first = (1.0 - share) * self.duration
        told = [
            Maneuver(kind, first + k * each, each, tuple(joints), fastest)
            for k, kind in enumerate(kinds)
        ]
        return replace(self, maneuvers=tuple(told))

    @cached_property
    def _free(self) -> np.ndarray:
        """(1 + 2 harmonics, waves): coefficients (c, a, b) of coordinates z. A unit of any moves the
        joint by a radian or so at most, whatever the harmonic: high ones are divided by their
        order."""
        k = np.arange(1, self.harmonics + 1)
        ends = np.zeros((2, 2 * self.harmonics))
        ends[0, : self.harmonics], ends[1, self.harmonics :] = k, k**2
        scale = np.concatenate([1.0 / k, 1.0 / k])
        waves = scale[:, None] * null_space(ends * scale)
        out = np.zeros((1 + 2 * self.harmonics, self.waves))
        out[0, 0], out[1:, 1:] = 1.0, waves
        return out

    def basis(self, t) -> np.ndarray:
        """(4, n, size): what z of a joint gives of q, qd, qdd and jerk at times t (n,)."""
        t = np.asarray(t, dtype=float)
        if not self.maneuvers:
            return self._waves(t)
        out = np.zeros((4, len(t), self.size))
        out[..., : self.waves] = self._waves(np.minimum(t, self.time))
        out[1:, t > self.time] = 0.0
        for k, own in enumerate(self.maneuvers):
            out[..., self.waves + k] = own.motion(t)
        return out

    def _waves(self, t) -> np.ndarray:
        w = 2.0 * np.pi * self.rounds / self.time * np.arange(1, self.harmonics + 1)
        angle = t[:, None] * w
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
        return z[:, : self.waves] @ self._free.T

    def motion(self, z, t) -> np.ndarray:
        """q, qd, qdd, jerk (4, n, dof) of coordinates z (dof, size) at times t (n,)."""
        return self.basis(t) @ z.T
