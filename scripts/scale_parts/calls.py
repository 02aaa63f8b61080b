"""Calls in one process: the torque of a model beside Pinocchio's, and our solver beside a general one."""

from __future__ import annotations

import statistics
import time

from .arm import PANDA
from .processes import CONFIG


def torque(repeats: int) -> dict:
    """One sample a call, ours and Pinocchio's in turns, and a million samples at once; processor time, medians, after a warm-up."""
    import numpy as np
    import pinocchio as pin

    from sysid import inverse_dynamics, listed_effects, robot
    from sysid.robot_spec import RobotSpec
    from sysid.specs import EffectSpec

    machine = robot.load(RobotSpec(urdf=PANDA, joints=[f"panda_joint{k}" for k in range(1, 8)]))
    structure = listed_effects.build(
        machine, [EffectSpec(name="viscous"), EffectSpec(name="coulomb")]
    )
    ours = inverse_dynamics.inverse_dynamics(
        structure, np.concatenate([machine.prior.ravel(), np.ones(14)])
    )
    samples = np.random.default_rng(0).normal(size=(3, 1_000_000, machine.dof))
    one, data, calls = [np.array(x[0]) for x in samples], machine.model.createData(), 2000
    spent: dict[str, list[float]] = {"ours": [], "bare": [], "many": []}
    for _ in range(repeats + 1):
        start = time.process_time()
        for _ in range(calls):
            pin.rnea(machine.model, data, *one)
        middle = time.process_time()
        for _ in range(calls):
            ours(*one)
        end = time.process_time()
        ours(*samples)
        for name, seconds, count in (
            ("bare", middle - start, calls),
            ("ours", end - middle, calls),
            ("many", time.process_time() - end, samples.shape[1]),
        ):
            spent[name].append(1e6 * seconds / count)
    bare, own, many = (statistics.median(spent[name][1:]) for name in ("bare", "ours", "many"))
    return {
        "microseconds": own,
        "rnea_microseconds": bare,
        "samples": samples.shape[1],
        "microseconds_a_sample": many,
    }


def solve(repeats: int) -> dict:
    """Our solver, 20 starts of it, and a general convex solver, on one compressed problem in one process."""
    import warnings

    import numpy as np

    warnings.simplefilter("ignore")
    import cvxpy as cp

    from sysid import config
    from sysid.inertia.pseudo import PSEUDO_BASIS, to_pseudo
    from sysid.studies import restarts

    shared = restarts.share(config.load(CONFIG))
    problem, experiment = shared.problem, shared.experiment

    starts = [restarts.random_start(len(problem.start), 0, k) for k in range(20)]
    objective, positive = problem.objective, problem.coordinates.positive
    prior, count = objective.divergence.prior, 10 * objective.bodies
    size = np.append(np.repeat(np.linalg.norm(prior, axis=1), 10), np.ones(len(positive)))

    def general():
        x = cp.Variable(len(size))
        physical = cp.multiply(size, x)
        terms = []
        for b in range(objective.bodies):
            own = to_pseudo(prior[b])
            scale = np.diag(1.0 / np.sqrt(np.diagonal(own)))
            pseudo = scale @ sum(physical[10 * b + k] * PSEUDO_BASIS[k] for k in range(10)) @ scale
            reference = scale @ own @ scale
            terms.append(
                -cp.log_det(pseudo)
                + np.linalg.slogdet(reference)[1]
                + cp.trace(np.linalg.inv(reference) @ pseudo)
                - 4
            )
        rows = objective.triangle[:-1]
        cost = cp.sum_squares(rows[:, :-1] @ physical - rows[:, -1]) + objective.weight * sum(terms)
        task = cp.Problem(
            cp.Minimize(cost), [physical[count + int(k)] >= 0 for k in np.flatnonzero(positive)]
        )
        task.solve(solver=cp.CLARABEL)
        return float(task.value) + objective.triangle[-1, -1] ** 2, task.solver_stats.solve_time

    def timed(work):
        start = time.perf_counter()
        result = work()
        return time.perf_counter() - start, result

    # the three take turns, so that a busy machine is busy for all; each counts with its median, after a warm-up
    own, many, theirs, alone = [], [], [], []
    for _ in range(repeats + 1):
        seconds, solution = timed(lambda: problem.solve(experiment))
        own.append(seconds)
        seconds, ends = timed(lambda: [problem.solve(experiment, start=start) for start in starts])
        many.append(seconds)
        seconds, (value, clarabel) = timed(general)
        theirs.append(seconds)
        alone.append(clarabel)
    own, many, theirs, alone = (
        statistics.median(values[1:]) for values in (own, many, theirs, alone)
    )
    return {
        "solve_seconds": own, "restarts_over_solve": many / own, "cvxpy_over_solve": theirs / own, "clarabel_over_solve": alone / own,
        "objective_difference": abs(value / solution.objective - 1), "restarts_spread": max(e.objective for e in ends) / min(e.objective for e in ends) - 1,
    }  # fmt: skip
