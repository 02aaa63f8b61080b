"""Precision: a design's information and what parameters err by, against random motions, a design for
the condition number, and FIGAROH's.

FIGAROH (1.0.2) seeks the least condition number of the base regressor as it stands, over cubic splines
through waypoints, by cyipopt with differences. cyipopt has no wheel; its criterion and its motions are
here, with CasADi's IPOPT and exact slopes. What ends is shrunk to the same limits as everything else.
"""

from __future__ import annotations

import tempfile
import time
import warnings
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.linalg import qr

from scripts.design_parts import solvers
from scripts.design_parts.robots import unlogged, unlogged_experiment
from scripts.design_parts.splines import Splines
from sysid.design import search, solve
from sysid.design.problem import shrunk, told, torque, value

ROBOTS = ("leg", "ur5", "panda", "ur10e")
RANDOM = 1000  # motions that keep to the limits
LOGS = 20  # of which parameters are fitted
RATE = 100.0  # Hz of these
_SPREAD = 1e-9  # of the largest eigenvalue: below, no motion shows a direction
_STARTS = 2  # of FIGAROH's


def case(seed: int, number: int, robots=ROBOTS) -> dict:
    """Robot and seed."""
    return {"robot": robots[number % len(robots)], "seed": seed + number // len(robots)}


def trial(case: dict) -> dict:
    """log det and mean parameter error of four motions, from the URDF."""
    out, motions = {**case, "cpu": {}, "log_det": {}, "error": {}, "kappa": {}}, {}
    seed = case["seed"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        problem, pose, rounds = unlogged(case["robot"])
        fastest = max(rounds) * problem.family.harmonics / problem.family.duration
        base, tell = _base(problem, pose, rounds, seed)

        def timed(name, work):
            begun = time.process_time()
            motions[name] = work()
            out["cpu"][name] = time.process_time() - begun

        timed("designed", lambda: search.searched(problem, pose, fastest, seed, processes=1)[0])
        timed("random", lambda: _random(problem, pose, rounds, seed))
        timed("condition", lambda: _condition(problem, pose, rounds, seed, base))
        if "IPOPT" in solvers.SOLVERS:
            timed("FIGAROH", lambda: _figaroh(problem, pose, seed))
        for name, found in motions.items():
            if found is None:
                continue
            own = problem.of(found.family)
            out["log_det"][name] = value(own, found.z)[1]
            out["kappa"][name] = _kappa(own, found.z, base)
            begun = time.process_time()
            out["error"][name] = _error(case["robot"], own, found.z, tell, seed)
            out["cpu"][f"{LOGS} fits, {name}"] = time.process_time() - begun
    return out


def _random(problem, pose, rounds, seed: int):
    """The best of many random motions that keep to the limits."""
    best, count, k = None, 0, 0
    while count < RANDOM and k < 20 * RANDOM:
        own = search.start(problem, pose, (seed, rounds[k % len(rounds)], 10_000 + k))
        count, k = count + bool(np.isfinite(own.value)), k + 1
        best = own if best is None or own.log_det > best.log_det else best
    return best


def _base(problem, pose, rounds, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(size, base) directions that random motions show, each a deviation that one of them would leave:
    base parameters, all alike. And (base, size) what changes of parameters are of them."""
    grams = []
    for k in range(8):
        start = search.start(problem, pose, (seed, rounds[k % len(rounds)], 5000 + k))
        grams.append(_gram(told(problem.of(start.family), start.z)))
    typical = np.mean(grams, axis=0) * problem.samples / len(problem.nodes)
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(typical), 1e-300))
    values, vectors = np.linalg.eigh(typical * np.outer(scale, scale))
    shown = values > _SPREAD * values[-1]
    base = scale[:, None] * vectors[:, shown] / np.sqrt(values[shown])
    return base, base.T @ typical


def _kappa(problem, z, base) -> float:
    """Condition number of the regressor of base parameters in such units."""
    values = np.linalg.eigvalsh(base.T @ _gram(told(problem, z)) @ base)
    return float(np.sqrt(values[-1] / max(values[0], 1e-300)))


@contextmanager
def _least_condition(problem, base):
    """Within, what a motion is worth is the condition number of its regressor of base (size, base)
    parameters, less; in units as log det has, so that prices and thresholds mean the same."""
    weight, kept = float(problem.known.model.size), solve.worth

    def worth(known, information):
        own = base.T @ (information - known.before) @ base
        scale = 1.0 / np.sqrt(np.max(np.diagonal(own)))
        values, vectors = np.linalg.eigh(own * scale**2)
        values = np.maximum(values, 1e-14 * values[-1])
        low, high = (scale * base @ vectors[:, k] for k in (0, -1))
        slope = np.outer(low, low) / values[0] - np.outer(high, high) / values[-1]
        return weight * float(np.log(values[0] / values[-1])), weight * slope

    solve.worth = worth
    try:
        yield worth
    finally:
        solve.worth = kept


def _condition(problem, pose, rounds, seed: int, base):
    """The motion with the least condition number that the same search finds, each base parameter in
    units of what a random motion tells of it: the usual design, Gautier & Khalil 1992."""
    kappa = lambda found: _kappa(problem.of(found.family), found.z, base)  # noqa: E731
    starts = [
        search.start(problem, pose, (seed, r, k)) for r in rounds for k in range(search.DRAWN)
    ]
    starts = [replace(one, value=-kappa(one)) for one in starts if np.isfinite(one.value)]
    climbs = [solve.Climb(one.family, one.z) for one in search.promising(starts)]
    with _least_condition(problem, base):
        *_, climbs = search.raced(problem, climbs, processes=1)
    ended = [solve.ended(problem, climb) for climb in climbs]
    return min((one for one in ended if np.isfinite(one.value)), key=kappa)


def _figaroh(problem, pose, seed: int):
    """FIGAROH's criterion over its motions; None where none keeps to the limits."""
    family = Splines(problem.family.duration, problem.family.dof)
    own = problem.of(family)
    shapes = problem.geometry.shapes.copy()
    shapes.removeAllCollisionPairs()
    free = replace(own, geometry=replace(problem.geometry, shapes=shapes))
    rng, ended, base = np.random.default_rng(seed), [], None
    for _ in range(_STARTS):
        z = shrunk(own, family.drawn(problem.limits, pose, rng))
        if z is None:
            continue
        if base is None:
            base = _independent(told(own, z) * problem.known.noise[:, None, None])
        with _least_condition(problem, base):
            ends, _ = solvers.SOLVERS["IPOPT"](free, z)
        kept = [found for end in (*ends, z) if (found := shrunk(own, end)) is not None]
        ended += [(_kappa(own, one, base), one) for one in kept]
    if not ended:
        return None
    best = min(ended, key=lambda one: one[0])[1]
    return solve.Found(family, best, *value(own, best))


def _independent(columns) -> np.ndarray:
    """(size, base) unit vectors of columns (dof, size, n) none of which the others make."""
    flat = np.moveaxis(columns, 1, 2).reshape(-1, columns.shape[1])
    _, r, order = qr(flat, mode="economic", pivoting=True)
    size = np.abs(np.diagonal(r))
    return np.eye(columns.shape[1])[:, np.sort(order[size > 1e-7 * size[0]])]


def _error(robot: str, problem, z, tell, seed: int) -> float:
    """Mean error of base parameters, each in the deviation that a random motion would tell it with, over
    fits of logs of a motion that a robot like its URDF makes."""
    from sysid import pipeline
    from sysid.compress import compress
    from sysid.estimate import identify
    from sysid.held_apart import chosen
    from sysid.log import Log
    from sysid.model import moving_coefficients
    from sysid.preprocess import prepare
    from sysid.prior_weight import with_weight
    from sysid.segment import Segment
    from sysid.simulate.truth import true_bodies

    known, rng = problem.known, np.random.default_rng([seed, 3])
    t = np.arange(int(round(problem.family.duration * RATE)) + 1) / RATE
    q, qd, qdd, _ = problem.family.motion(z, t)
    usual = np.abs(torque(problem, q, qd, qdd)).mean(axis=0)
    found, weight = [], None
    with tempfile.TemporaryDirectory() as place:
        experiment = unlogged_experiment(robot, Path(place))
        _, model, prior = pipeline.build(experiment)
        spec = experiment.preprocess.model_copy(update={"filter": "savitzky-golay", "window": 0.1})
        for _ in range(LOGS):
            x = np.array(known.x)
            count = 10 * known.model.bodies
            x[:count] = true_bodies(known.model.robot, rng).ravel()
            for k, c in enumerate(known.model.coefficients):
                speed = np.abs(qd[:, c.joint]).mean()
                x[count + k] = 0.1 * usual[c.joint] / (speed if c.effect == "viscous" else 1.0)
            true = replace(problem, known=replace(known, x=x))
            tau = torque(true, q, qd, qdd) + known.noise * rng.standard_normal(q.shape)
            log = Log("log", Path("log"), "", (Segment(t, 1.0 / RATE, q, tau, None, None, {}),))
            motion = prepare([log], spec, model.robot.joints)
            data, moving = compress(model, motion), moving_coefficients(model, motion)
            if weight is None:  # as the first log chooses it
                weight = chosen(with_weight(experiment, "auto"), model, data, moving, prior).value
            fit = identify(with_weight(experiment, weight), model, motion, data, prior)
            place_of = [model.names.index(name) for name in known.model.names]
            found.append(np.mean(np.abs(tell @ (fit.x[place_of] - x))))
    return float(np.mean(found))


def _gram(columns) -> np.ndarray:
    flat = np.moveaxis(columns, 1, 2).reshape(-1, columns.shape[1])
    return flat.T @ flat


def table(results: list[dict]) -> list[str]:
    """log det, mean parameter error and condition number of each motion, by robot."""
    names = ("designed", "random", "condition", "FIGAROH")
    out = ["robot    " + "".join(f"{name:>30s}" for name in names)]
    for r in results:
        cells = [
            f"{r['log_det'][n]:.1f}, error {r['error'][n]:.3f} ({r['kappa'][n]:.0f})"
            if n in r["log_det"]
            else "-"
            for n in names
        ]
        out.append(f"{r['robot']:9s}" + "".join(f"{cell:>30s}" for cell in cells))
    out.append(f"log det, mean error of base parameters over {LOGS} logs (condition number)")
    return out
