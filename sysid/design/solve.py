"""The motion that tells most within its limits.

Maximised is log det M by steps of linear programs: its slope, and every limit that a step could
reach, linearised at the nodes (positions, speeds, accelerations and jerks are linear in the
coordinates as they are), within a trust region that grows where a step keeps its promise and
shrinks where it does not. Where a limit is passed between the nodes, that instant becomes one.

Source: Fletcher & Sainz de la Maza 1989 (successive linear programs with a trust region).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import linprog

from .collision import Near
from .columns import Slopes
from .information import log_det_with_slope
from .problem import Problem, passed, shares, shrunk, value

STEPS = (40, 15, 10, 10)  # linear programs, again each time that more times are looked at
_FIRST, _WIDEST, _NARROWEST = 0.1, 0.5, 1e-3  # rad or m: radius of the trust region
_GOOD, _BAD = 0.7, 0.25  # of what a step promised: from there it is wider, up to there narrower
_SETTLED = 1e-2  # of log det M: a step that gains less is the last
_PRICE = 1e4  # of log det M for going beyond a limit by as much as the limit
_LOOKED = 25.0  # Hz at which distances are while the motion is sought
_SIGHT = 0.03  # m beyond the clearance: pairs that a step minds; others are looked at afterwards


@dataclass(frozen=True)
class Found:
    """A motion z (dof, size) of a number of rounds and its log det M; -inf where none keeps to the
    limits."""

    rounds: int
    z: np.ndarray
    value: float


@dataclass(frozen=True)
class Climb:
    """Where a search stands: coordinates z (dof, size) of a motion of a number of rounds, the trust
    region's radius, times (n,) [s] beside the nodes at which limits are looked at, how often these
    have grown, and the linear programs since."""

    rounds: int
    z: np.ndarray
    radius: float = _FIRST
    extra: np.ndarray = field(default_factory=lambda: np.zeros(0))
    stage: int = 0
    steps: int = 0

    @property
    def over(self) -> bool:
        """Whether it has ended."""
        return self.stage >= len(STEPS)

    @property
    def share(self) -> float:
        """How much of it is done, at least."""
        return min(1.0, (sum(STEPS[: self.stage]) + self.steps) / sum(STEPS))


def climbed(problem: Problem, climb: Climb, steps: int) -> Climb:
    """A search after so many linear programs more, or where it ends. The problem's own number of
    rounds is not looked at: the search has one."""
    problem = problem.with_rounds(climb.rounds)
    while steps > 0 and not climb.over:
        grid = _grid(problem, climb.extra)
        at, radius, done, settled = _look(problem, climb.z, grid), climb.radius, climb.steps, False
        while steps > 0 and done < STEPS[climb.stage] and not settled:
            at, radius, settled = _stepped(problem, at, grid, radius)
            done, steps = done + 1, steps - 1
        climb = replace(climb, z=at.z, radius=radius, steps=done)
        if settled or done >= STEPS[climb.stage]:
            times = passed(problem, climb.z)
            # between the nodes a limit is passed: these times are looked at, too
            extra = np.union1d(climb.extra, times)
            stage = climb.stage + 1 if len(times) else len(STEPS)
            climb = replace(climb, extra=extra, stage=stage, steps=0, radius=_FIRST)
    return climb


def ended(problem: Problem, climb: Climb) -> Found:
    """The motion of a search, shrunk to what keeps to every limit."""
    problem = problem.with_rounds(climb.rounds)
    kept = shrunk(problem, climb.z)
    told = -np.inf if kept is None else value(problem, kept)
    return Found(climb.rounds, climb.z if kept is None else kept, told)


@dataclass(frozen=True)
class _Grid:
    """Times at which a motion is looked at: nodes, and `extra` times [s] that limits alone look at.
    basis: of all of them; weights (n,): how many samples each stands for; poses (m, size): the basis
    of q at the times at which distances are looked at."""

    basis: np.ndarray
    weights: np.ndarray
    poses: np.ndarray


def _grid(problem: Problem, extra) -> _Grid:
    nodes = problem.nodes
    weights = np.concatenate([np.full(len(nodes), problem.samples / len(nodes)), 0.0 * extra])
    count = int(np.ceil(_LOOKED * problem.family.duration)) if problem.geometry.looks else 0
    often = np.union1d((np.arange(count) + 0.5) / _LOOKED, extra)
    poses = problem.family.basis(often)[0]
    return _Grid(problem.family.basis(np.concatenate([nodes, extra])), weights, poses)


@dataclass(frozen=True)
class _Look:
    """A motion at the nodes: log det M and its slope (dof, size), (4, n, dof) motion, torque (n, dof)
    and its slope (n, dof, dof, size), pairs that are near, and what goes beyond limits, in all."""

    z: np.ndarray
    told: float
    slope: np.ndarray
    motion: np.ndarray
    torque: np.ndarray
    pull: np.ndarray
    near: Near
    beyond: float

    @property
    def merit(self) -> float:
        """What a step must raise."""
        return self.told - _PRICE * self.beyond


def _look(problem: Problem, z, grid: _Grid) -> _Look:
    x, dof, basis = problem.known.x, problem.family.dof, grid.basis
    motion = basis @ z.T
    slopes = Slopes.of(problem.known.model, *motion[:3])
    told, by_node = log_det_with_slope(problem.known, slopes, grid.weights)
    slope = np.einsum("rin,rnz->iz", by_node.reshape(3, dof, -1), basis[:3])
    own = np.einsum("jpn,p->nj", slopes.here, x)
    change = np.tensordot(slopes.change, x, (1, 0)).reshape(dof, 3, dof, -1)
    pull = np.einsum("jrin,rnz->njiz", change, basis[:3])
    clearance = problem.limits.clearance
    near = problem.geometry.near(grid.poses @ z.T, clearance + _SIGHT)
    lacks = float(np.max(clearance - near.distance, initial=0.0)) / max(clearance, 1e-3)
    over = float(np.maximum(shares(problem, motion, own) - 1.0, 0.0).max())
    return _Look(z, told, slope, motion, own, pull, near, max(over, 0.1 * lacks, 0.0))


def _stepped(problem: Problem, at: _Look, grid: _Grid, radius: float) -> tuple[_Look, float, bool]:
    """A motion after one linear program, the radius of the next, and whether it is settled."""
    found = _step(problem, at, grid, radius)
    if found is None:
        return at, radius, True
    change, promised = found
    new = _look(problem, at.z + change, grid)
    gained = new.merit - at.merit
    wider = gained > _GOOD * promised
    if gained <= _BAD * promised:
        radius *= 0.5
    elif wider:
        radius = min(2.0 * radius, _WIDEST)
    if gained <= 0.0:
        return at, radius, radius < _NARROWEST
    return new, radius, gained < _SETTLED


def _step(
    problem: Problem, at: _Look, grid: _Grid, radius: float
) -> tuple[np.ndarray, float] | None:
    """The change (dof, size) of the best linear program within a radius, and by how much it promises
    to raise the merit; None where there is none."""
    limits, dof, size = problem.limits, problem.family.dof, problem.family.size
    rows, most, basis = [], [], grid.basis

    def bound(values, slopes, limit):
        """|values + slopes d| <= limit, of those rows that a step can bring there."""
        can = np.abs(values) + radius * np.abs(slopes).sum(axis=1) > limit
        for sign in (1.0, -1.0):
            rows.append(sign * slopes[can])
            most.append(limit - sign * values[can])

    bounds = (limits.half, limits.velocity, limits.acceleration, limits.jerk)
    middle = (limits.middle, 0.0, 0.0, 0.0)
    for own, reach, limit, centre in zip(at.motion, basis, bounds, middle):
        for j in range(dof):
            slopes = np.zeros((len(reach), dof, size))
            slopes[:, j] = reach
            value = own[:, j] - (centre[j] if np.ndim(centre) else centre)
            bound(value / limit[j], slopes.reshape(len(reach), -1) / limit[j], 1.0)
    for j in range(dof):
        if np.isfinite(limits.torque[j]):
            slopes = at.pull[:, j].reshape(len(at.pull), -1) / limits.torque[j]
            bound(at.torque[:, j] / limits.torque[j], slopes, 1.0)
    scale, near = max(limits.clearance, 1e-2), at.near
    slopes = np.einsum("mi,mz->miz", near.slope, grid.poses[near.pose]).reshape(-1, dof * size)
    room = near.distance - limits.clearance
    can = radius * np.abs(slopes).sum(axis=1) > room
    rows.append(-slopes[can] / scale)
    most.append(room[can] / scale)
    rows, most = np.concatenate(rows), np.concatenate(most)
    # one slack for all, so that there is a step from where a limit is passed, too
    matrix = np.column_stack([rows, -np.ones(len(rows))])
    gain = np.append(-at.slope.ravel(), _PRICE)
    free = [(-radius, radius)] * (dof * size) + [(0.0, None)]
    found = linprog(gain, A_ub=matrix, b_ub=most, bounds=free, method="highs")
    if found.status != 0:
        return None
    return found.x[:-1].reshape(dof, size), _PRICE * at.beyond - found.fun
