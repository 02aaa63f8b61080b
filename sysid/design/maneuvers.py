"""Maneuvers: what sums of harmonics do badly, put after them where an effect asks for it.

ladder      constant speeds both ways, each half as fast as the one before
reversals   slow loops out and back, each half as large as the one before
poses       moves from pose to pose, each then crept through both ways: at rest friction may have any
            value up to its greatest, and a fit leaves such rows out
chirp       ever faster, up to the frequencies that the logs' filter still lets through

Each is a joint's way from where it stands and back, at rest at both ends, one unit (a radian or a metre)
at its farthest; how much of it a joint does is a coordinate of the motion as those of harmonics are.
Its speed is a cubic spline, so that its jerk has no jumps.

Source: Hamel & Jategaonkar 1996 (maneuvers in series for system identification, there of aircraft).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

_KNOTS_PER_CYCLE = 24.0  # of a spline's fastest part
_SLOWEST = 100  # knots at least for each part of a maneuver
_RUNGS = 4  # of a ladder; sizes of loops
_RAMP = 0.3  # share of a run at constant speed that it takes to come to it, and to stop
_TAPER = 0.15  # of a chirp
_CREEP = 0.2  # of a way between two poses: what is crept through at each
_POSES = (1.0, -1.0, 0.5, 0.0)


@dataclass(frozen=True)
class Maneuver:
    """A maneuver of a kind (of `KINDS`) from `start` [s] on, over `duration` [s]. joints: those that
    begin with it, all where there are none. fastest [Hz]: of a chirp."""

    kind: str
    start: float
    duration: float
    joints: tuple[int, ...]
    fastest: float

    @cached_property
    def _rates(self) -> tuple:
        """The way and its first three derivatives, as piecewise polynomials of time since its start."""
        speed, parts, cycles = KINDS[self.kind]
        many = cycles(self.duration, self.fastest) * _KNOTS_PER_CYCLE
        t = np.linspace(0.0, self.duration, int(max(_SLOWEST * parts, many)) + 1)
        u = t / self.duration
        values = speed(u, self.duration, self.fastest)
        bell = np.sin(np.pi * u) ** 2  # takes off what does not end where it began
        ends = [
            CubicSpline(t, v, bc_type="clamped").integrate(0.0, self.duration)
            for v in (values, bell)
        ]
        own = CubicSpline(t, values - ends[0] / ends[1] * bell, bc_type="clamped")
        way = own.antiderivative()
        own = CubicSpline(t, own(t) / np.abs(way(t)).max(), bc_type="clamped")
        return own.antiderivative(), own, own.derivative(), own.derivative(2)

    def motion(self, t) -> np.ndarray:
        """(4, n) q, qd, qdd and jerk of one unit of it at times t (n,) of the whole motion; zero before
        and after."""
        own = np.asarray(t) - self.start
        inside = (own >= 0.0) & (own <= self.duration)
        out = np.zeros((4, len(own)))
        for row, rate in zip(out, self._rates):
            row[inside] = rate(own[inside])
        return out


def _step(u):
    """From 0 to 1 with neither slope nor curvature at the ends."""
    u = np.clip(u, 0.0, 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)


def _run(u):
    """Speed (n,) of a run from rest over 0 to 1, to rest: constant but for its ends."""
    return _step(u / _RAMP) * _step((1.0 - u) / _RAMP)


def _in_turn(u, shares, of: Callable) -> np.ndarray:
    """Values (n,) of parts that take so much of the time each: of(number, u within it)."""
    edges = np.concatenate([[0.0], np.cumsum(shares)]) / np.sum(shares)
    number = np.clip(np.searchsorted(edges, u, side="right") - 1, 0, len(shares) - 1)
    out = np.zeros(len(u))
    for k in range(len(shares)):
        own = number == k
        out[own] = of(k, (u[own] - edges[k]) / (edges[k + 1] - edges[k]))
    return out


def _ladder(u, duration, fastest):
    run = lambda k, own: (-1.0) ** k * 0.5 ** (k // 2) * _run(own)  # noqa: E731
    return _in_turn(u, np.ones(2 * _RUNGS), run)


def _reversals(u, duration, fastest):
    loop = lambda own: np.sin(2.0 * np.pi * own) * np.sin(np.pi * own) ** 2  # noqa: E731
    return _in_turn(u, np.ones(2 * _RUNGS), lambda k, own: 0.5 ** (k // 2) * loop(own))


def _poses(u, duration, fastest):
    """A move, then a creep there and a creep back, each as long."""
    ways = np.diff([0.0, *_POSES])

    def part(k, own):
        way, crept = ways[k // 3], _CREEP * (1.0 if k % 3 == 1 else -1.0)
        bell = 30.0 * own**2 * (1.0 - own) ** 2
        return way * bell if k % 3 == 0 else crept * _run(own)

    return _in_turn(u, np.ones(3 * len(_POSES)), part)


def _chirp(u, duration, fastest):
    """From two rounds in its time up to the fastest, evenly in the logarithm of frequency."""
    low = min(2.0 / duration, fastest)
    ratio = max(fastest / low, 1.0 + 1e-9)
    phase = 2.0 * np.pi * low * duration * (ratio**u - 1.0) / np.log(ratio)
    return np.sin(phase) * _step(u / _TAPER) * _step((1.0 - u) / _TAPER)


#: speed at shares u (n,) of its time, given duration [s] and fastest [Hz]; how many parts it has; and
#: how many cycles its spline must follow
KINDS = {
    "ladder": (_ladder, 2 * _RUNGS, lambda duration, fastest: 0.0),
    "reversals": (_reversals, 2 * _RUNGS, lambda duration, fastest: 0.0),
    "poses": (_poses, 3 * len(_POSES), lambda duration, fastest: 0.0),
    "chirp": (_chirp, 1, lambda duration, fastest: duration * fastest),
}
