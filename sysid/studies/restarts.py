"""Section VII of the paper: one problem, many random starts.

Every coordinate of every body and the logarithm of every friction coefficient is drawn uniformly from [-1, 1]. All
starts share one compressed problem: errors on training and test logs, at every iterate of every start, come from the
two logs' triangles, never from samples.
"""

import time
from dataclasses import dataclass

import numpy as np

from ..fit_document import number
from ..posed_problem import Problem, noise_weights, pose
from ..specs import Experiment
from ..triangles import Compressed
from .prepared import prepared


@dataclass(frozen=True)
class Shared:
    """What all starts share."""

    experiment: Experiment
    problem: Problem
    train: Compressed
    test: Compressed
    notices: tuple[str, ...]


def share(experiment: Experiment) -> Shared:
    """Read and compress both sets of logs, and pose the problem. Raises SysidError."""
    found = prepared(experiment)
    experiment = found.experiment
    problem = pose(experiment, found.model, found.train, found.moving, found.prior)
    if experiment.solver.weighting == "noise":
        weights = noise_weights(found.train, problem.solve(experiment).x)
        problem = pose(experiment, found.model, found.train, found.moving, found.prior, weights)
    return Shared(experiment, problem, found.train, found.test, found.notices)


def random_start(size: int, seed: int, index: int) -> np.ndarray:
    """theta (size,) of start `index`, the same whatever other starts are run."""
    return np.random.default_rng([seed, index]).uniform(-1.0, 1.0, size)


def one(shared: Shared, seed: int, index: int) -> dict:
    """Solve from one random start; everything but `seconds` is determined by the arguments."""
    problem = shared.problem
    theta = random_start(len(problem.start), seed, index)
    held = np.append(np.zeros(10 * problem.objective.bodies, dtype=bool), problem.coordinates.held)
    theta = np.where(held, problem.start, theta)
    begin = time.perf_counter()
    found = problem.solve(shared.experiment, start=theta)
    seconds = time.perf_counter() - begin
    certificate = problem.certify(found.x)
    return {
        "objective": list(found.objectives), "rms_train": [_rms(shared.train, x) for x in found.trace],
        "rms_test": [_rms(shared.test, x) for x in found.trace], "iterations": found.iterations,
        "newton_iterations": found.newton_iterations, "converged": found.converged,
        "globally_optimal": certificate.globally_optimal, "gap": number(certificate.gap),
        "seconds": seconds,
    }  # fmt: skip


def _rms(data: Compressed, x) -> float:
    """RMS over all joints and rows [N m]."""
    return float(np.sqrt(data.squares(x).sum() / data.rows.sum()))


def summary(runs: list[dict], shared: Shared, seed: int) -> dict:
    """The JSON document of `sysid study restarts`."""
    last = [run["objective"][-1] for run in runs]
    return {
        "restarts": len(runs), "seed": seed, "inertia": shared.experiment.model.inertia,
        "objective": last, "rms_train": [run["rms_train"][-1] for run in runs], "rms_test": [run["rms_test"][-1] for run in runs],
        "initial_rms_train": [run["rms_train"][0] for run in runs], "initial_objective": [run["objective"][0] for run in runs],
        "iterations": [run["iterations"] for run in runs], "newton_iterations": [run["newton_iterations"] for run in runs],
        "converged": sum(run["converged"] for run in runs), "globally_optimal": sum(run["globally_optimal"] for run in runs),
        "gap": [run["gap"] for run in runs],
        "relative_spread": (max(last) - min(last)) / abs(min(last)),
        "notices": list(shared.notices),
        "seconds": {"solve": [run["seconds"] for run in runs]},
    }  # fmt: skip
