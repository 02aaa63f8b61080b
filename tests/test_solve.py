"""The solver against cvxpy + clarabel, its derivatives against differences, its certificate against the truth."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from sysid import interior
from sysid.certificate import certify
from sysid.inertia import PARAMETERIZATIONS, is_consistent
from sysid.inertia.pseudo import PSEUDO_BASIS, to_pseudo
from sysid.objective import Objective
from sysid.solve import Coordinates, _Problem
from tests.problems import arm, leg, posed

CASES = {"leg": leg, "arm": arm}


def clarabel_objective(problem) -> float:
    """Minimum of eq. 14 by a general convex solver, in the physical parameters."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import cvxpy as cp

        objective, positive = problem.objective, problem.coordinates.positive
        triangle, prior, bodies = objective.triangle, objective.divergence.prior, objective.bodies
        # one unit for everything: columns scaled to the prior's size, as any careful user of a solver would
        size = np.append(np.repeat([np.linalg.norm(p) for p in prior], 10), np.ones(len(positive)))
        x = cp.Variable(len(size))
        physical = cp.multiply(size, x)
        terms, constraints = [], []
        for b in range(bodies):
            pseudo = sum(physical[10 * b + k] * PSEUDO_BASIS[k] for k in range(10))
            own = to_pseudo(prior[b])
            scale = np.diag(1.0 / np.sqrt(np.diagonal(own)))  # congruence: conditioning only, the divergence does not see it
            scaled, reference = scale @ pseudo @ scale, scale @ own @ scale
            if objective.divergence.name == "log-det":
                terms.append(-cp.log_det(scaled) + np.linalg.slogdet(reference)[1] + cp.trace(np.linalg.inv(reference) @ scaled) - 4)
            else:
                step = physical[10 * b : 10 * b + 10] - prior[b]
                root = np.linalg.cholesky(objective.divergence.hessian(prior)[b]).T
                terms.append(0.5 * cp.sum_squares(root @ step))
                constraints.append(scaled >> 0)
        constraints += [physical[10 * bodies + k] >= 0 for k in np.flatnonzero(positive)]
        # residual part orthogonal to the columns is a constant, kept out for the solver's sake
        columns, target = triangle[:-1, :-1], triangle[:-1, -1]
        constant = triangle[-1, -1] ** 2
        cost = cp.sum_squares(columns @ physical - target) + objective.weight * sum(terms)
        task = cp.Problem(cp.Minimize(cost), constraints)
        task.solve(solver=cp.CLARABEL, tol_gap_abs=1e-9, tol_gap_rel=1e-10, tol_feas=1e-10, max_iter=500)
        assert task.status in ("optimal", "optimal_inaccurate"), task.status
        # the solver's own optimum: at a point that it rounded, a body may stand a rounding outside the cone, where the formula is infinite
        return float(task.solution.opt_val) + constant


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("prior", [{}, {"divergence": "pullback"}, {"divergence": "euclidean"}], ids=lambda p: p.get("divergence", "log-det"))
def test_objective_agrees_with_cvxpy_and_clarabel(name, prior):
    experiment, problem = posed(CASES[name](), prior=prior)
    solution = problem.solve(experiment)
    assert solution.converged
    np.testing.assert_allclose(solution.objective, clarabel_objective(problem), rtol=1e-6)


@pytest.mark.parametrize("inertia", ["log-cholesky", "exponential", "eigenvalue"])
@pytest.mark.parametrize("name", CASES)
def test_every_start_ends_in_the_certified_optimum(name, inertia):
    experiment, problem = posed(CASES[name](), model={"inertia": inertia})
    best = problem.solve(experiment)
    rng = np.random.default_rng(3)
    for _ in range(3):
        solution = problem.solve(experiment, start=rng.uniform(-1, 1, len(problem.start)))
        assert solution.converged and solution.objectives[0] > 10 * best.objective
        np.testing.assert_allclose(solution.objective, best.objective, rtol=1e-10)
        certificate = certify(problem.objective, solution.x, problem.coordinates.positive, problem.coordinates.held)
        assert certificate.globally_optimal and certificate.stationarity < 1e-6
        bodies = solution.x[: 10 * problem.objective.bodies].reshape(-1, 10)
        assert is_consistent(bodies).all()


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("divergence", ["log-det", "pullback", "euclidean"])
def test_certificate_bounds_what_can_be_gained(name, divergence):
    """The bound must hold at every point, also at those that are not optimal: it is a proof, not a score."""
    experiment, problem = posed(CASES[name](), prior={"divergence": divergence})
    objective, coordinates = problem.objective, problem.coordinates
    best = problem.solve(experiment)
    rng = np.random.default_rng(4)
    theta = coordinates.theta(best.x) if divergence == "log-det" else problem.start
    for size in (1e-8, 1e-6, 1e-4, 1e-2, 1.0):
        x = coordinates.physical(theta + size * rng.normal(size=len(theta)))
        certificate = certify(objective, x, coordinates.positive, coordinates.held)
        gained = objective.value(x) - best.objective
        assert certificate.gap * objective.value(x) >= gained * (1 - 1e-6) - 1e-9 * best.objective
        if gained > 1e-7 * best.objective:
            assert not certificate.globally_optimal
    assert certify(objective, best.x, coordinates.positive, coordinates.held).globally_optimal


def test_friction_that_goes_to_zero_is_named_with_its_gradient():
    experiment, structure, motion, data, prior = arm()
    triangle = data.total()
    # add 30 N m s/rad of driving torque in proportion to speed: the best viscous coefficient is negative
    names = structure.names
    k = names.index("viscous.elbow_joint.Fv")
    shifted = triangle.copy()
    shifted[:, -1] -= 30.0 * triangle[:, k]
    _, problem = posed(arm())
    objective = Objective(shifted, problem.objective.divergence, problem.objective.weight)
    problem = replace(problem, objective=objective)
    solution = problem.solve(experiment)
    certificate = certify(objective, solution.x, problem.coordinates.positive, problem.coordinates.held)
    assert solution.converged and certificate.globally_optimal
    # Coulomb friction, correlated with speed, may follow it to zero; each is held by its bound
    assert k - 10 * structure.bodies in certificate.at_zero
    for i, slope in certificate.at_zero.items():
        assert slope > 0 and 0 <= solution.x[10 * structure.bodies + i] < 1e-6
    np.testing.assert_allclose(solution.objective, clarabel_objective(problem), rtol=1e-6)


@pytest.mark.parametrize("inertia", PARAMETERIZATIONS)
def test_gradient_and_hessian_in_the_solver_s_coordinates(inertia):
    _, problem = posed(leg(), model={"inertia": inertia})
    objective, coordinates = problem.objective, problem.coordinates
    # coordinates at which nothing is extreme, so that differences can be trusted
    rng = np.random.default_rng(5)
    theta = problem.start + 0.05 * rng.normal(size=len(problem.start)) * (inertia != "linear")
    derive = _Problem(objective, coordinates)
    value = lambda at: objective.value(coordinates.physical(at))  # noqa: E731
    gradient, hessian, _ = derive.expand(theta, coordinates.physical(theta))
    for _ in range(5):
        step = rng.normal(size=len(theta)) * (1.0 if inertia != "linear" else np.abs(theta))
        slope = lambda h: (value(theta + h * step) - value(theta - h * step)) / (2 * h)  # noqa: B023, E731
        np.testing.assert_allclose(gradient @ step, (4 * slope(1e-5) - slope(2e-5)) / 3, rtol=1e-6)
        ahead, back = (derive.expand(theta + s * 1e-6 * step, coordinates.physical(theta + s * 1e-6 * step))[0] for s in (1, -1))
        change = (ahead - back) / 2e-6
        np.testing.assert_allclose(hessian @ step, change, rtol=1e-4, atol=1e-5 * np.abs(change).max())


def test_held_coefficients_do_not_move_and_zero_weight_is_least_squares():
    experiment, problem = posed(leg())
    held = np.zeros(6, dtype=bool)
    held[[1, 4]] = True
    coordinates = Coordinates(problem.coordinates.parameterization, 6, problem.coordinates.positive, held)
    solution = replace(problem, coordinates=coordinates).solve(experiment)
    start = coordinates.physical(problem.start)
    np.testing.assert_allclose(solution.x[-6:][held], start[-6:][held], rtol=1e-12)
    assert solution.converged and certify(problem.objective, solution.x, coordinates.positive, held).globally_optimal

    experiment, problem = posed(leg(), model={"inertia": "linear"}, prior={"weight": 0.0})
    solution = problem.solve(experiment)
    triangle = problem.objective.triangle
    x = np.linalg.lstsq(triangle[:, :-1], triangle[:, -1], rcond=1e-12)[0]
    np.testing.assert_allclose(solution.objective, np.sum((triangle[:, :-1] @ x - triangle[:, -1]) ** 2), rtol=1e-9)


def test_interior_point_alone_from_anywhere():
    _, problem = posed(leg())
    rng = np.random.default_rng(6)
    ends = []
    for _ in range(3):
        x = problem.coordinates.physical(rng.uniform(-1, 1, len(problem.start)))
        iterates, _, converged = interior.minimise(problem.objective, problem.coordinates.positive, problem.coordinates.held, x, tolerance=1e-8)
        assert converged and len(iterates) < 60
        ends.append(problem.objective.value(iterates[-1]))
    np.testing.assert_allclose(ends, ends[0], rtol=1e-12)


@pytest.mark.parametrize("name, seed", [("leg", 146), ("leg", 209), ("arm", 331), *(("arm", seed) for seed in range(8)), *(("leg", seed) for seed in range(8))])
def test_interior_point_where_bodies_cannot_make_the_torque(name, seed):
    """A model that lacks much bends its bodies far: the search went round and round, or along the boundary in steps of a
    hundredth (the first three), and what was best by then passed for a fit."""
    _, problem = posed(CASES[name]())
    rng, triangle, x = np.random.default_rng(seed), problem.objective.triangle.copy(), problem.coordinates.physical(problem.start)
    own = triangle[:-1, :-1] @ x
    triangle[:-1, -1] = own + rng.normal(size=len(own)) * np.linalg.norm(triangle[:-1, -1]) * 10 ** rng.uniform(-2, 0) / np.sqrt(len(triangle))
    objective = replace(problem.objective, triangle=triangle, weight=10 ** rng.uniform(-2, 4))
    iterates, values, converged = interior.minimise(objective, problem.coordinates.positive, problem.coordinates.held, x, tolerance=1e-8)
    assert converged and len(iterates) < 60
    assert certify(objective, iterates[-1], problem.coordinates.positive, problem.coordinates.held, constrained=True).globally_optimal


@pytest.mark.parametrize("nought", [0.0, 1e-320, 1e-200])
def test_interior_point_from_a_coefficient_at_nought(nought):
    """Where a search in logarithms sent it there, no multiplier belongs to it: the same optimum all the same."""
    _, problem = posed(leg())
    x = problem.coordinates.physical(problem.start)
    how = problem.objective, problem.coordinates.positive, problem.coordinates.held
    best = problem.objective.value(interior.minimise(*how, x, tolerance=1e-8)[0][-1])
    for k in np.flatnonzero(problem.coordinates.positive):
        x[10 * problem.objective.bodies + k] = nought
    iterates, _, converged = interior.minimise(*how, x, tolerance=1e-8)
    assert converged and all(np.isfinite(at).all() for at in iterates)
    np.testing.assert_allclose(problem.objective.value(iterates[-1]), best, rtol=1e-10)


def test_one_iteration_is_not_convergence():
    experiment, problem = posed(leg(), solver={"max_iterations": 1})
    assert not problem.solve(experiment).converged


@pytest.mark.parametrize("weight", [1e-2, 1.0, 1e2, 1e4])
def test_coefficients_at_zero_beside_a_strong_prior(weight):
    """Frictionless and nearly without noise: what is left of the coefficients falls while the bodies stay at the prior's weight."""
    from sysid import config, robot
    from sysid.compress import compress
    from sysid.listed_effects import build
    from sysid.preprocess import prepare
    from tests.problems import UR5, arm_log

    effects = ["viscous", "coulomb", "torque_bias", "armature"]
    experiment = config.experiment({"robot": {"urdf": UR5}, "model": {"effects": effects}})
    machine = robot.load(experiment.robot)
    structure = build(machine, experiment.model.effects)
    log = arm_log(machine, np.random.default_rng(1), noise=1e-3, viscous=0.0, coulomb=0.0)
    motion = prepare([log], experiment.preprocess, machine.joints)
    case = experiment, structure, motion, compress(structure, motion), np.array(machine.prior)
    changed, problem = posed(case, prior={"weight": weight})
    solution = problem.solve(changed)
    assert solution.converged and solution.iterations < 40
