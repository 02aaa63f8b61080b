"""What every row of a log tells by itself, or with its neighbours: found part by part, in one pass.

Parts follow one another, and each is looked at with the last rows of the one before: what stands
between two is seen, and a log in parts tells what it tells as one.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np

from ..full_turns import jumps
from ..log import DEGREES
from ..robot import Robot
from ..segment import GAP_STEPS
from .samples import Samples, Told, behind, told

BEYOND = 0.02  # rad or m beyond a limit, and share of the range
FASTER = 1.5  # times a limit of speed, as many a URDF states the rated one
JITTER = 0.05  # of a step, RMS: what is less, resampling mends
SPAN = 0.05  # s over which a speed is taken
_MOST = 4096  # rows of the part before that are looked at again: a speed's, at any rate of a logger


@dataclass(frozen=True)
class OfJoint:
    """Of one joint's angle: jumps by a turn, angles beyond two turns, beyond its limits, and speeds
    beyond its limit."""

    wraps: Told
    far: Told
    beyond: Told
    fast: Told

    def then(self, later: OfJoint) -> OfJoint:
        """With what a later part tells."""
        pairs = ((getattr(self, own.name), getattr(later, own.name)) for own in fields(self))
        return OfJoint(*(one.then(other) for one, other in pairs))


@dataclass(frozen=True)
class Tally:
    """What the rows of a log tell.

    samples, begin, end [s]: of the log. low, high (2, dof): the least and the greatest angle and
    torque; first (dof,): the first torque. joints: of each. gaps, late: rows after which the clock
    has a gap, and whose step is irregular; off, regular: squares [s^2] and number of steps without
    a gap, by which these are off a whole number of usual steps; worst: the step that is least like
    the usual. again: rows that only repeat the one before. equal (2, dof, dof): whether the angles,
    or the torques, of two joints are equal in every row.
    """

    samples: int
    begin: float
    end: float
    low: np.ndarray
    high: np.ndarray
    first: np.ndarray
    joints: tuple[OfJoint, ...]
    gaps: Told
    late: Told
    off: float
    regular: int
    worst: Told
    again: Told
    equal: np.ndarray

    def then(self, later: Tally) -> Tally:
        """With what a later part tells."""
        return Tally(
            self.samples + later.samples, self.begin, later.end,
            np.minimum(self.low, later.low), np.maximum(self.high, later.high), self.first,
            tuple(one.then(other) for one, other in zip(self.joints, later.joints)),
            self.gaps.then(later.gaps), self.late.then(later.late), self.off + later.off,
            self.regular + later.regular, self.worst.then(later.worst),
            self.again.then(later.again), self.equal & later.equal,
        )  # fmt: skip

    @property
    def travel(self) -> np.ndarray:
        """How far (dof,) each joint's angle goes."""
        return self.high[0] - self.low[0]

    @property
    def swing(self) -> np.ndarray:
        """How far (dof,) each joint's torque goes."""
        return self.high[1] - self.low[1]

    @property
    def jitter(self) -> float:
        """By how much the clock's steps are off, RMS [s]."""
        return float(np.sqrt(self.off / max(self.regular, 1)))


def tallied(parts: Iterable[Samples], step: float, robot: Robot) -> Tally:
    """What the parts of a log tell, one after another; step [s]: the usual one of its clock."""
    found, over = None, min(lag_of(step), _MOST)
    for part, seen in behind(parts, over):
        own = _of_part(part, seen, step, robot)
        found = own if found is None else found.then(own)
    return found


def lag_of(step: float) -> int:
    """How many rows apart speeds are taken."""
    return max(1, round(SPAN / step))


def speeds(t, q, step: float) -> np.ndarray:
    """Size of a joint's speed over short spans, from its angles q (n,) at times t (n,)."""
    lag = lag_of(step)
    return np.abs(q[lag:] - q[:-lag]) / np.maximum(t[lag:] - t[:-lag], 1e-9)


def _of_part(part: Samples, seen: int, step: float, robot: Robot) -> Tally:
    """What a part tells, of whose rows the first `seen` stand in the one before."""
    t, q, tau = part.t[seen:], part.q[seen:], part.tau[seen:]
    since = slice(max(seen - 1, 0), None)  # a step leads to each row but the log's first
    before, steps = part.t[since][:-1], np.diff(part.t[since])
    gap, strange = steps > GAP_STEPS * step, np.abs(steps - step)
    # missing samples are whole steps more, and no jitter
    off = steps[~gap] - step * np.maximum(np.round(steps[~gap] / step), 1.0)
    moved, changed = (np.diff(values[since], axis=0) for values in (part.q, part.tau))
    again = np.all(moved == 0.0, axis=1) & np.all(changed == 0.0, axis=1)
    moved[gap] = 0.0  # nobody knows how far it turned meanwhile
    joints = tuple(_of_joint(part, seen, moved[:, j], j, step, robot) for j in range(q.shape[1]))
    return Tally(
        len(t), float(t[0]), float(t[-1]), np.array([q.min(0), tau.min(0)]),
        np.array([q.max(0), tau.max(0)]), tau[0].copy(), joints,
        told(gap, steps, before), told(np.abs(off) > JITTER * step, np.abs(off), before[~gap]),
        float(np.sum(off**2)), len(off), told(np.ones(len(steps), bool), strange, before),
        told(again, again, part.t[since][1:]), np.array([_equal(q), _equal(tau)]),
    )  # fmt: skip


def _of_joint(part: Samples, seen: int, moved, j: int, step: float, robot: Robot) -> OfJoint:
    t, q, since = part.t[seen:], part.q[seen:, j], max(seen - 1, 0)
    slides, (low, high) = bool(robot.prismatic[j]), robot.limits[j]
    jumped, size = jumps(moved), np.abs(q)
    room = BEYOND * max(1.0, high - low) if np.isfinite(high - low) else np.inf
    beyond = (q < low - room) | (q > high + room)
    lag = min(lag_of(step), len(part.t))
    again = slice(max(seen - lag, 0), None)  # the first row whose speed the part before lacks
    top = speeds(part.t[again], part.q[again, j], step)
    allowed = robot.source.joints[robot.joints[j]].velocity
    return OfJoint(
        Told() if slides else told(jumped, np.abs(moved), part.t[since:][1:]),
        Told() if slides else told(size > DEGREES, size, t),
        told(beyond & (high > low), np.maximum(low - q, q - high), t, q),
        told(top > FASTER * allowed, top, part.t[again]),
    )


def _equal(values) -> np.ndarray:
    """Whether columns of values (n, dof) are equal (dof, dof), for each with those behind it."""
    same = np.triu(values[0][:, None] == values[0], 1)  # what differs at once need not be compared
    for i, j in np.argwhere(same):
        same[i, j] = np.array_equal(values[:, i], values[:, j])
    return same
