"""The motion that tells most within its limits.

Maximised is log det M by steps of linear programs: its slope, and every limit that a step could
reach, linearised at the nodes (positions, speeds, accelerations and jerks are linear in the
coordinates as they are), within a trust region that grows where a step keeps its promise. What is
left over a limit, seen at a kilohertz, is taken off by shrinking the motion about its middle pose,
which keeps to every limit. Several starts, each from a random motion.

Source: Fletcher & Sainz de la Maza 1989 (successive linear programs with a trust region).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from .. import regressor
from .collision import Geometry
from .columns import Slopes, in_runs
from .fourier import Fourier
from .information import Known, gram, log_det, log_det_with_slope
from .limits import Limits

_NODES = 12.0  # for each period of the fastest harmonic: inertia goes with its square and products
_STEPS = (40, 15, 10, 10)  # linear programs, again each time that more times are looked at
_FIRST, _WIDEST, _NARROWEST = 0.1, 0.5, 1e-3  # rad or m: radius of the trust region
_SETTLED = 1e-2  # of log det M: a step that gains less is the last
_PRICE = 1e4  # of log det M for going beyond a limit by as much as the limit
_CHECKED = 1000.0  # Hz at which limits are kept
_CLOSE = 100.0  # Hz at which distances are: between two looks a link's point moves a few mm
_LOOKED = 50.0  # Hz at which they are while the motion is sought
_SIGHT = (
    0.03  # m beyond the clearance: pairs that a step minds; of others it is looked at afterwards
)
_BISECTIONS = 12


@dataclass(frozen=True)
class Problem:
    """Everything that a design is made of. rate [Hz]: of the log that will be made of it."""

    known: Known
    limits: Limits
    geometry: Geometry
    family: Fourier
    rate: float

    @property
    def nodes(self) -> np.ndarray:
        """Times (n,) [s] at which the criterion is looked at."""
        fastest = self.family.rounds * self.family.harmonics / self.family.duration
        count = int(np.ceil(_NODES * fastest * self.family.duration))
        return (np.arange(count) + 0.5) * self.family.duration / count

    @property
    def samples(self) -> float:
        """Samples of the log."""
        return self.rate * self.family.duration


@dataclass(frozen=True)
class Found:
    """A motion and its log det M; -inf where none keeps to the limits."""

    family: Fourier
    z: np.ndarray
    value: float


def value(problem: Problem, z) -> float:
    """log det M of a motion."""
    q, qd, qdd, _ = problem.family.motion(z, problem.nodes)
    return log_det(problem.known.before + gram(problem.known, q, qd, qdd, problem.samples))


def shares(problem: Problem, motion, torque) -> np.ndarray:
    """(5, n, dof) of q, qd, qdd, jerk and torque, as shares of their limits: 1 is at the limit."""
    q, qd, qdd, jerk = motion
    own = problem.limits
    return np.stack([
        np.abs(q - own.middle) / own.half, np.abs(qd) / own.velocity,
        np.abs(qdd) / own.acceleration, np.abs(jerk) / own.jerk, np.abs(torque) / own.torque,
    ])  # fmt: skip


def checked(problem: Problem) -> np.ndarray:
    """Times (n,) [s] at which limits are kept."""
    return np.arange(0.0, problem.family.duration + 0.5 / _CHECKED, 1.0 / _CHECKED)


def torque(problem: Problem, q, qd, qdd) -> np.ndarray:
    """Torque (n, dof) that the model predicts for samples of a motion."""
    model, x = problem.known.model, problem.known.x
    count = 10 * model.bodies
    if model.size == count:
        return regressor.torque(model.robot, x[:count].reshape(-1, 10), q, qd, qdd)
    out = np.empty_like(q)
    for rows, found in in_runs(model, q, qd, qdd):
        out[rows] = np.einsum("jpn,p->nj", found, x)
    return out


def keeps(problem: Problem, z) -> bool:
    """Whether a motion keeps to every limit, looked at a kilohertz."""
    motion = problem.family.motion(z, checked(problem))
    if np.any(shares(problem, motion, 0.0 * motion[0])[:4] > 1.0):
        return False
    if np.any(shares(problem, motion, torque(problem, *motion[:3]))[4] > 1.0):
        return False
    every = int(_CHECKED // _CLOSE)
    return bool(np.all(problem.geometry.least(motion[0][::every]) >= problem.limits.clearance))


def shrunk(problem: Problem, z) -> np.ndarray | None:
    """The largest share of a motion about its middle pose that keeps to the limits; None where not
    even the pose does."""
    if keeps(problem, z):
        return z
    still = np.zeros_like(z)
    still[:, 0] = z[:, 0]
    if not keeps(problem, still):
        return None
    low, high = 0.0, 1.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if keeps(problem, still + middle * (z - still)):
            low = middle
        else:
            high = middle
    return still + low * (z - still)


def drawn(problem: Problem, pose, rng: np.random.Generator) -> np.ndarray:
    """A random motion about a pose (dof,), as large as positions, speeds, accelerations and jerks
    let it."""
    family, limits = problem.family, problem.limits
    z = np.zeros((family.dof, family.size))
    room = 0.8 * limits.half
    near = pose + 0.3 * limits.half * rng.uniform(-1.0, 1.0, family.dof)
    z[:, 0] = np.clip(near, limits.middle - room, limits.middle + room)
    z[:, 1:] = rng.standard_normal((family.dof, family.size - 1))
    waves = np.concatenate([0.0 * z[:, :1], z[:, 1:]], 1)
    q, qd, qdd, jerk = family.motion(waves, problem.nodes)
    room = limits.half - np.abs(z[:, 0] - limits.middle)
    share = [
        room / np.abs(q).max(0), limits.velocity / np.abs(qd).max(0),
        limits.acceleration / np.abs(qdd).max(0), limits.jerk / np.abs(jerk).max(0),
    ]  # fmt: skip
    z[:, 1:] *= (rng.uniform(0.3, 1.0) * np.min(share, axis=0))[:, None]
    return z


@dataclass(frozen=True)
class _Grid:
    """Times at which a motion is looked at: nodes, and `extra` times [s] that limits alone look at.
    basis: of all of them; weights (n,): how many samples each stands for; poses (m, size): the basis
    of q at the times at which distances are looked at."""

    extra: np.ndarray
    basis: np.ndarray
    weights: np.ndarray
    poses: np.ndarray


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
    near: list
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
    change = np.einsum("p,jpvn->jvn", x, slopes.change).reshape(dof, 3, dof, -1)
    pull = np.einsum("jrin,rnz->njiz", change, basis[:3])
    clearance = problem.limits.clearance
    near = problem.geometry.near(grid.poses @ z.T, clearance + _SIGHT)
    lacks = max((clearance - d for _, d, _ in near), default=0.0) / max(clearance, 1e-3)
    over = float(np.maximum(shares(problem, motion, own) - 1.0, 0.0).max())
    return _Look(z, told, slope, motion, own, pull, near, max(over, 0.1 * lacks, 0.0))


def _step(problem: Problem, at: _Look, grid: _Grid, radius: float) -> np.ndarray | None:
    """The change (dof, size) of the best linear program within a radius; None where there is none."""
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
    scale = max(limits.clearance, 1e-2)
    for node, distance, slope in at.near:
        rows.append(-np.einsum("i,z->iz", slope, grid.poses[node]).reshape(1, -1) / scale)
        most.append(np.array([(distance - limits.clearance) / scale]))
    rows, most = np.concatenate(rows), np.concatenate(most)
    # one slack for all, so that there is a step from where a limit is passed, too
    matrix = np.column_stack([rows, -np.ones(len(rows))])
    gain = np.append(-at.slope.ravel(), _PRICE)
    free = [(-radius, radius)] * (dof * size) + [(0.0, None)]
    found = linprog(gain, A_ub=matrix, b_ub=most, bounds=free, method="highs")
    return found.x[:-1].reshape(dof, size) if found.status == 0 else None


def improved(
    problem: Problem, start, report: Callable[[float], None] = lambda share: None
) -> Found:
    """The best motion that is found from a start (dof, size)."""
    grid, z = _grid(problem, np.zeros(0)), shrunk(problem, np.array(start))
    if z is None:
        return Found(problem.family, np.array(start), -np.inf)
    for number, steps in enumerate(_STEPS):
        tell = lambda share, number=number: report((number + share) / len(_STEPS))  # noqa: E731
        z = _climbed(problem, z, grid, steps, tell)
        times = _passed(problem, z)
        if not len(times):
            break
        # between the nodes a limit is passed: these times are looked at, too
        grid = _grid(problem, np.union1d(grid.extra, times))
    report(1.0)
    kept = shrunk(problem, z)
    told = -np.inf if kept is None else value(problem, kept)
    return Found(problem.family, z if kept is None else kept, told)


def _climbed(problem: Problem, z, grid: _Grid, steps: int, report) -> np.ndarray:
    """The best motion after so many linear programs."""
    radius = _FIRST
    at = _look(problem, z, grid)
    for step in range(steps):
        change = _step(problem, at, grid, radius)
        if change is None:
            break
        new = _look(problem, at.z + change, grid)
        if (gained := new.merit - at.merit) > 0.0:
            at, radius = new, min(1.5 * radius, _WIDEST)
            if gained < _SETTLED:
                break
        elif (radius := 0.4 * radius) < _NARROWEST:
            break
        report((step + 1) / steps)
    return at.z


def _grid(problem: Problem, extra) -> _Grid:
    nodes = problem.nodes
    weights = np.concatenate([np.full(len(nodes), problem.samples / len(nodes)), 0.0 * extra])
    count = int(np.ceil(_LOOKED * problem.family.duration)) if problem.geometry.looks else 0
    often = np.union1d((np.arange(count) + 0.5) / _LOOKED, extra)
    poses = problem.family.basis(often)[0]
    return _Grid(extra, problem.family.basis(np.concatenate([nodes, extra])), weights, poses)


def _passed(problem: Problem, z) -> np.ndarray:
    """Times (n,) [s] at which limits are passed by most, for each joint and limit."""
    t = checked(problem)
    motion = problem.family.motion(z, t)
    over = shares(problem, motion, torque(problem, *motion[:3]))
    found = [
        t[_peaks(own)] for own in np.moveaxis(over, 1, 2).reshape(-1, len(t)) if own.max() > 1.0
    ]
    every = int(_CHECKED // _CLOSE)
    lacks = 2.0 - problem.geometry.least(motion[0][::every]) / max(problem.limits.clearance, 1e-6)
    return np.concatenate([*found, t[::every][_peaks(lacks)], np.zeros(0)])


def _peaks(share) -> np.ndarray:
    """Where values (n,) above one are greatest, each within its stretch above one."""
    above = np.concatenate([[False], share > 1.0, [False]])
    starts, stops = np.flatnonzero(above[1:] & ~above[:-1]), np.flatnonzero(above[:-1] & ~above[1:])
    return np.array([a + int(np.argmax(share[a:b])) for a, b in zip(starts, stops)], dtype=int)
