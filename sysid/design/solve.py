"""The motion that tells most within its limits.

Maximised is what a motion is worth by steps of linear programs: its slope, and every limit that a
step could reach, linearised at the nodes (positions, speeds, accelerations and jerks are linear in the
coordinates as they are), within a trust region that grows where a step keeps its promise and
shrinks where it does not. Where a limit is passed between the nodes, that instant becomes one.

Source: Fletcher & Sainz de la Maza 1989 (successive linear programs with a trust region).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ..model_parameters import ROBOT
from . import linear_program
from .collision import Near
from .columns import columns, with_changes
from .fourier import Fourier
from .information import information, worth
from .problem import CLOSE, Problem, looking_back, passed, shares, shrunk, told, torque, value
from .slopes import slopes

STEPS = (40, 15, 10, 10)  # linear programs, again each time that more times are looked at
_FIRST, _WIDEST, _NARROWEST = 0.1, 0.5, 1e-3  # rad or m: radius of the trust region
_GOOD, _BAD = 0.7, 0.25  # of what a step promised: from there it is wider, up to there narrower
_NUDGE = 1e-5  # rad or m of a coordinate: along whose motion a suspect looks back
_STANDS = 0.1  # rad or m of a coordinate: so far the slope of what looks back stands
_SETTLED = 1e-2  # of its worth: a step that gains less is the last
_PRICE = 1e4  # of its worth for going beyond a limit by as much as the limit
_LOOKED = 25.0  # Hz at which distances are while the motion is sought
_STRONG = 0.5  # of a limit: torques that a step minds; others are looked at afterwards
_SIGHT = 0.03  # m beyond the clearance: pairs that a step minds; others are looked at afterwards


@dataclass(frozen=True)
class Found:
    """A motion z (dof, size) of a family, what it is worth, and log det M alone; -inf where none keeps
    to the limits."""

    family: Fourier
    z: np.ndarray
    value: float
    log_det: float = -np.inf

    @classmethod
    def of(cls, problem: Problem, z: np.ndarray, close: int = CLOSE) -> Found:
        """The largest share of a motion that keeps to every limit; close: as of `shrunk`."""
        kept, family = shrunk(problem, z, close), problem.family
        return cls(family, z, -np.inf) if kept is None else cls(family, kept, *value(problem, kept))


@dataclass(frozen=True)
class Climb:
    """Where a search stands: coordinates z (dof, size) of a motion of a family, the trust
    region's radius, times (n,) [s] beside the nodes at which limits are looked at, how often these
    have grown, and the linear programs since; merit: what it is worth less what goes beyond limits."""

    family: Fourier
    z: np.ndarray
    radius: float = _FIRST
    extra: np.ndarray = field(default_factory=lambda: np.zeros(0))
    stage: int = 0
    steps: int = 0
    merit: float = -np.inf

    @property
    def over(self) -> bool:
        """Whether it has ended."""
        return self.stage >= len(STEPS)

    @property
    def share(self) -> float:
        """How much of it is done, at least."""
        return min(1.0, (sum(STEPS[: self.stage]) + self.steps) / sum(STEPS))


def climbed(problem: Problem, climb: Climb, steps: int) -> Climb:
    """A search after so many linear programs more, or where it ends. The problem's own family
    is not looked at: the search has one."""
    problem = problem.of(climb.family)
    while steps > 0 and not climb.over:
        grid = _grid(problem, climb.extra)
        at, radius, done, settled = _look(problem, climb.z, grid), climb.radius, climb.steps, False
        near, touched = _nearby(problem, at, grid), np.zeros(0, dtype=int)
        while steps > 0 and done < STEPS[climb.stage] and not settled:
            new, radius, settled, touched = _stepped(problem, at, near, grid, radius, touched)
            done, steps = done + 1, steps - 1
            if new is not at:
                at, near = new, _nearby(problem, new, grid, near.back)
        climb = replace(climb, z=at.z, radius=radius, steps=done, merit=at.merit)
        if settled or done >= STEPS[climb.stage]:
            times = passed(problem, climb.z)
            # between the nodes a limit is passed: these times are looked at, too
            extra = np.union1d(climb.extra, times)
            stage = climb.stage + 1 if len(times) else len(STEPS)
            climb = replace(climb, extra=extra, stage=stage, steps=0, radius=_FIRST)
    return climb


def ended(problem: Problem, climb: Climb) -> Found:
    """The motion of a search, shrunk to what keeps to every limit."""
    return Found.of(problem.of(climb.family), climb.z)


@dataclass(frozen=True)
class _Grid:
    """Times at which a motion is looked at: nodes, and `extra` times [s] that limits alone look at.
    basis: of all of them; nodes: how many are nodes; poses (m, size): the basis of q at the times at
    which distances are looked at."""

    basis: np.ndarray
    nodes: int
    poses: np.ndarray


def _grid(problem: Problem, extra) -> _Grid:
    nodes = problem.nodes
    count = int(np.ceil(_LOOKED * problem.family.duration)) if problem.geometry.looks else 0
    often = np.union1d((np.arange(count) + 0.5) / _LOOKED, extra)
    poses = problem.family.basis(often)[0]
    return _Grid(problem.family.basis(np.concatenate([nodes, extra])), len(nodes), poses)


@dataclass(frozen=True)
class _Look:
    """A motion: what it is worth, the slope (all, all) of that in M, the columns (dof, all, nodes), the
    motion (4, n, dof), torque (n, dof), and what goes beyond limits, in all."""

    z: np.ndarray
    worth: float
    slope: np.ndarray
    columns: np.ndarray
    motion: np.ndarray
    torque: np.ndarray
    beyond: float

    @property
    def merit(self) -> float:
        """What a step must raise."""
        return self.worth - _PRICE * self.beyond


def _look(problem: Problem, z, grid: _Grid) -> _Look:
    known, motion = problem.known, grid.basis @ z.T
    own = columns(known.model, *motion[:3])
    needed = np.einsum("jpn,p->nj", own, known.x)
    found = told(problem, z, motion[:, : grid.nodes], own[..., : grid.nodes])
    weights = np.full(grid.nodes, problem.samples / grid.nodes)
    value, slope = worth(known, information(known, found, weights))
    clearance = problem.limits.clearance
    least = problem.geometry.least(grid.poses @ z.T, clearance)
    lacks = float(np.max(clearance - least, initial=0.0)) / max(clearance, 1e-3)
    over = float(np.max(shares(problem, motion, needed) - 1.0, initial=0.0))
    return _Look(z, value, slope, found, motion, needed, max(over, 0.1 * lacks))


@dataclass(frozen=True)
class _Nearby:
    """What a motion's neighbours are like, to first order: the slope (dof, size) of its worth; the rows
    at which torque is strong, and torque's slopes (rows, dof size) there by joint, as shares of its
    limit; pairs of links that are near; and what `climbs` keeps."""

    slope: np.ndarray
    strong: np.ndarray
    torque: dict[int, np.ndarray]
    links: Near
    back: dict[int, tuple[np.ndarray, np.ndarray]]


def _nearby(problem: Problem, at: _Look, grid: _Grid, back: dict | None = None) -> _Nearby:
    limits, dof, torques = problem.limits, problem.family.dof, {}
    back = {} if back is None else back
    strong = np.flatnonzero((np.abs(at.torque) > _STRONG * limits.torque).any(axis=1))
    if len(strong):
        _, change = with_changes(lambda *asked: torque(problem, *asked).T, *at.motion[:3, strong])
        for j in np.flatnonzero(np.isfinite(limits.torque)):
            own = change[j].reshape(3, dof, -1) / limits.torque[j]
            slopes = np.einsum("rin,rnz->niz", own, grid.basis[:3, strong])
            torques[int(j)] = slopes.reshape(len(strong), -1)
    links = problem.geometry.near(grid.poses @ at.z.T, limits.clearance + _SIGHT)
    return _Nearby(climbs(problem, at, grid, back), strong, torques, links, back)


def climbs(problem: Problem, at: _Look, grid: _Grid, back: dict | None = None) -> np.ndarray:
    """The slope (dof, size) of what a motion is worth in its coordinates.

    Args:
        back: slopes of what looks back along the motion, by suspect, with the coordinates that they
            are of: they stand for others nearby, and new ones are put there.
    """
    known, weight = problem.known, problem.samples / grid.nodes
    pull = 2.0 * weight * np.matmul(at.slope, at.columns)
    by_node = slopes(known, pull, *at.motion[:3, : grid.nodes])
    out = np.einsum("rin,rnz->iz", by_node, grid.basis[:3, : grid.nodes])
    back = {} if back is None else back
    for i, (place, one) in enumerate(zip(known.places, known.suspects)):
        joint = one.candidate.joint
        if not one.looks_back or joint == ROBOT:
            continue
        if i not in back or np.abs(at.z - back[i][0]).max() > _STANDS:
            here = at.columns[:, place]
            back[i] = at.z, _back(problem, one, at.z, joint, here)
        out[joint] += np.einsum("jpn,zjpn->z", pull[:, place], back[i][1])
    return out


def _back(problem: Problem, suspect, z, joint: int, here) -> np.ndarray:
    """(size, dof, k, nodes) slopes of a suspect's columns in the coordinates of a joint's motion, by
    differences: what others do to it enters with the next look."""
    out = np.empty((z.shape[1], *here.shape))
    for k, own in enumerate(out):
        moved = z.copy()
        moved[joint, k] += _NUDGE
        own[:] = (looking_back(problem, suspect, moved) - here) / _NUDGE
    return out


def _stepped(
    problem: Problem, at: _Look, near: _Nearby, grid: _Grid, radius: float, touched
) -> tuple[_Look, float, bool, np.ndarray]:
    """A motion after one linear program, the radius of the next, whether it is settled, and the limits
    that the program touched.

    Args:
        touched: by the program before.
    """
    step = linear_program.best(
        near.slope.ravel(), _limits(problem, at, near, grid), radius=radius, price=_PRICE,
        first=touched,
    )  # fmt: skip
    if step is None:
        return at, radius, True, touched
    promised = step.gain + _PRICE * at.beyond
    new = _look(problem, at.z + step.change.reshape(at.z.shape), grid)
    gained = new.merit - at.merit
    wider = gained > _GOOD * promised
    if gained <= _BAD * promised:
        radius *= 0.5
    elif wider:
        radius = min(2.0 * radius, _WIDEST)
    if gained <= 0.0:
        return at, radius, radius < _NARROWEST, step.touched
    return new, radius, gained < _SETTLED, step.touched


def _limits(
    problem: Problem, at: _Look, near: _Nearby, grid: _Grid
) -> Iterator[linear_program.Limit]:
    """Every limit of a joint's rate, of its torque, and of links, to first order, as shares."""
    limits, (dof, size) = problem.limits, at.z.shape
    bounds = (limits.half, limits.velocity, limits.acceleration, limits.jerk)
    middle = (limits.middle, *np.zeros((3, dof)))
    for own, reach, limit, centre in zip(at.motion, grid.basis, bounds, middle):
        for j in range(dof):
            slopes = np.zeros((len(reach), dof, size))
            slopes[:, j] = reach / limit[j]
            slopes = slopes.reshape(len(reach), -1)
            yield from linear_program.both((own[:, j] - centre[j]) / limit[j], slopes)
    for j, slopes in near.torque.items():
        share = at.torque[near.strong, j] / limits.torque[j]
        yield from linear_program.both(share, slopes, near.strong)
    links, scale = near.links, max(limits.clearance, 1e-2)
    slopes = np.einsum("mi,mz->miz", links.slope, grid.poses[links.pose]).reshape(-1, dof * size)
    order = np.lexsort((links.pose, links.pair))  # as time goes, for each pair
    yield linear_program.Limit(
        -slopes[order] / scale, (links.distance - limits.clearance)[order] / scale,
        (links.pair * len(grid.poses) + links.pose)[order],
    )  # fmt: skip
