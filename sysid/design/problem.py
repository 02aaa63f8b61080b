"""A design's motion against its limits: how much of each it uses, and how far it must shrink.

What is left over a limit, seen at a kilohertz, is taken off by shrinking the motion about its middle
pose. Positions, speeds, accelerations and jerks say at once by how much; torque and distances are
halved in on at the instants that pass theirs, and then looked at everywhere again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .collision import Geometry
from .columns import piece
from .fourier import Fourier
from .information import Known, information, log_det, worth
from .limits import Limits
from .suspects import Suspect, along

_NODES = 12.0  # for each period of the fastest harmonic: inertia goes with its square and products
_FINE = 0.01  # s: the steps of a motion that a suspect looks back along
_CHECKED = 1000.0  # Hz at which limits are kept
# Every so many of them distances are looked at while a motion is sought: between two a link's point
# moves a few mm, and links are nearer there than at both by less than a millimetre.
CLOSE = 10
_BISECTIONS = 10
_SMALLEST = 1e-3  # share of a motion that is none


@dataclass(frozen=True)
class Problem:
    """Everything that a design is made of. rate [Hz]: of the log that will be made of it."""

    known: Known
    limits: Limits
    geometry: Geometry
    family: Fourier
    rate: float

    @cached_property
    def nodes(self) -> np.ndarray:
        """Times (n,) [s] at which the criterion is looked at."""
        count = int(np.ceil(_NODES * self.family.fastest * self.family.duration))
        return (np.arange(count) + 0.5) * self.family.duration / count

    @property
    def samples(self) -> float:
        """Samples of the log."""
        return self.rate * self.family.duration

    @cached_property
    def checked(self) -> np.ndarray:
        """Times (n,) [s] at which limits are kept."""
        return np.arange(0.0, self.family.duration + 0.5 / _CHECKED, 1.0 / _CHECKED)

    @cached_property
    def basis(self) -> np.ndarray:
        """The family's basis (4, n, size) at these times."""
        return self.family.basis(self.checked)

    def of(self, family: Fourier) -> Problem:
        """The same of another family of motions."""
        return self if family == self.family else replace(self, family=family)

    def with_rounds(self, rounds: int) -> Problem:
        """The same of harmonics of other frequencies."""
        return self.of(replace(self.family, rounds=rounds))


def told(problem: Problem, z, motion=None, own=None) -> np.ndarray:
    """(dof, all, nodes) columns of a motion over their noise.

    Args:
        motion (4, nodes, dof) and own (dof, size, nodes), the model's columns: where they are at hand.
    """
    known = problem.known
    motion = problem.family.motion(z, problem.nodes) if motion is None else motion
    out = known.all_columns(*motion[:3], own)
    for place, one in zip(known.places, known.suspects):
        if one.looks_back:
            out[:, place] = looking_back(problem, one, z)
    return out


def looking_back(problem: Problem, suspect: Suspect, z) -> np.ndarray:
    """(dof, k, nodes) columns over their noise of a suspect that looks back along the motion."""
    known, family, count = problem.known, problem.family, len(problem.nodes)
    half = int(np.ceil(0.5 * (family.duration / count / _FINE - 1.0)))
    between = 2 * max(half, 0) + 1  # odd: nodes are samples of the finer motion, too
    step = family.duration / count / between
    motion = family.motion(z, step * (np.arange(count * between) + 0.5))
    rows = slice(between // 2, None, between)
    found = along([suspect], known.model, known.x, *motion[:3], step, rows)
    return found * known.counted(*motion[1:3, rows])[:, None]


def value(problem: Problem, z) -> tuple[float, float]:
    """What a motion is worth, and log det M alone."""
    count = len(problem.nodes)
    weights = np.full(count, problem.samples / count)
    found = information(problem.known, told(problem, z), weights)
    return worth(problem.known, found)[0], log_det(found)


def torque(problem: Problem, q, qd, qdd) -> np.ndarray:
    """Torque (n, dof) that the model predicts for samples of a motion."""
    model, x = problem.known.model, problem.known.x
    count = 10 * model.bodies
    return model.torque(piece(q, qd, qdd), x[:count].reshape(-1, 10), x[count:])


def shares(problem: Problem, motion, torque) -> np.ndarray:
    """(5, n, dof) of q, qd, qdd, jerk and torque, as shares of their limits: 1 is at the limit."""
    q, qd, qdd, jerk = motion
    own = problem.limits
    return np.stack([
        np.abs(q - own.middle) / own.half, np.abs(qd) / own.velocity,
        np.abs(qdd) / own.acceleration, np.abs(jerk) / own.jerk, np.abs(torque) / own.torque,
    ])  # fmt: skip


def passed(problem: Problem, z) -> np.ndarray:
    """Times (n,) [s] at which limits are passed by most, for each joint and limit."""
    t, motion = problem.checked, problem.basis @ z.T
    over = np.moveaxis(shares(problem, motion, torque(problem, *motion[:3])), 1, 2)
    found = [t[_peaks(own)] for own in over.reshape(-1, len(t)) if own.max() > 1.0]
    clearance = problem.limits.clearance
    lacks = clearance - problem.geometry.least(motion[0][::CLOSE], clearance)
    return np.concatenate([*found, t[::CLOSE][_peaks(1.0 + lacks)], np.zeros(0)])


def _peaks(share) -> np.ndarray:
    """Where values (n,) above one are greatest, each within its stretch above one."""
    above = np.concatenate([[False], share > 1.0, [False]])
    starts, stops = np.flatnonzero(above[1:] & ~above[:-1]), np.flatnonzero(above[:-1] & ~above[1:])
    return np.array([a + int(np.argmax(share[a:b])) for a, b in zip(starts, stops)], dtype=int)


def shrunk(problem: Problem, z, close: int = CLOSE) -> np.ndarray | None:
    """The largest share of a motion about its middle pose that keeps to the limits; None where not
    even the pose does.

    Args:
        close: distances are looked at every so many of the checked times.
    """
    still = _still(z)
    if not rests(problem, z):
        return None
    share = _kinematic(problem, z)
    whole = np.arange(len(problem.checked)), np.arange(0, len(problem.checked), close)
    while True:
        here = still + share * (z - still)
        over = _over(problem, here, *whole)
        if not any(map(len, over)):
            return here
        if share <= 0.0:
            return None
        low, high = 0.0, share
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            passes = any(map(len, _over(problem, still + middle * (z - still), *over)))
            low, high = (low, middle) if passes else (middle, high)
        # the others may still pass theirs; a motion that has all but gone is none
        share = low if low > _SMALLEST else 0.0


def rests(problem: Problem, z) -> bool:
    """Whether a robot that stands in a motion's middle pose keeps to the limits."""
    if np.any(np.abs(z[:, 0] - problem.limits.middle) > problem.limits.half):
        return False
    first = np.zeros(1, dtype=int)
    return not any(map(len, _over(problem, _still(z), first, first)))


def _still(z) -> np.ndarray:
    still = np.zeros_like(z)
    still[:, 0] = z[:, 0]
    return still


def _kinematic(problem: Problem, z) -> float:
    """The largest share of a motion at which positions and their rates keep to their limits."""
    own, waves = problem.limits, np.concatenate([0.0 * z[:, :1], z[:, 1:]], axis=1)
    q, qd, qdd, jerk = problem.basis @ waves.T
    off = z[:, 0] - own.middle
    room = np.maximum(np.where(q > 0.0, own.half - off, own.half + off), 1e-12)
    most = max(
        float(part.max())
        for part in (
            np.abs(q) / room, np.abs(qd) / own.velocity, np.abs(qdd) / own.acceleration,
            np.abs(jerk) / own.jerk,
        )
    )  # fmt: skip
    return 1.0 if most <= 1.0 else (1.0 - 1e-9) / most


def _over(problem: Problem, z, rows, poses) -> tuple[np.ndarray, np.ndarray]:
    """Those of the rows (n,) at which torque passes its limit, and of the poses (m,) at which links
    come too close; both number the checked times."""
    q, qd, qdd = problem.basis[:3, rows] @ z.T
    limited = np.isfinite(problem.limits.torque)
    strong = np.zeros(0, dtype=int)
    if len(rows) and limited.any():
        needed = np.abs(torque(problem, q, qd, qdd))
        strong = rows[np.any(needed > problem.limits.torque, axis=1)]
    clearance = problem.limits.clearance
    near = problem.geometry.least(problem.basis[0, poses] @ z.T, clearance) < clearance
    return strong, poses[near]


def drawn(problem: Problem, pose, rng: np.random.Generator) -> np.ndarray:
    """A random motion about a pose (dof,), as large as positions, speeds, accelerations and jerks
    let it."""
    family, limits = problem.family, problem.limits
    z = np.zeros((family.dof, family.size))
    room = 0.8 * limits.half
    near = pose + 0.3 * limits.half * rng.uniform(-1.0, 1.0, family.dof)
    z[:, 0] = np.clip(near, limits.middle - room, limits.middle + room)
    z[:, 1 : family.waves] = rng.standard_normal((family.dof, family.waves - 1))
    z[:, 1:] *= (rng.uniform(0.3, 1.0) * _room(problem, z))[:, None]
    here = family.basis(np.array([family.time]))[0] @ z.T
    for k, own in enumerate(family.maneuvers, family.waves):
        part = 0.0 * z
        part[:, k] = rng.choice([-1.0, 1.0], family.dof)
        part[:, 0] = here[0]
        joints = list(own.joints or range(family.dof))
        z[joints, k] = (part[:, k] * rng.uniform(0.3, 1.0) * _room(problem, part))[joints]
    return z


def _room(problem: Problem, z) -> np.ndarray:
    """(dof,) how many times as large about its middle pose a motion could be."""
    family, limits = problem.family, problem.limits
    waves = np.concatenate([0.0 * z[:, :1], z[:, 1:]], 1)
    most = [np.maximum(np.abs(part).max(0), 1e-12) for part in family.motion(waves, problem.nodes)]
    room = np.maximum(limits.half - np.abs(z[:, 0] - limits.middle), 0.0)
    share = [
        room / most[0], limits.velocity / most[1], limits.acceleration / most[2],
        limits.jerk / most[3],
    ]  # fmt: skip
    return np.min(share, axis=0)
