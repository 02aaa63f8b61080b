"""Solvers: the same criterion, limits and starts for the package's linear programs and for others."""

from __future__ import annotations

import importlib.util
import time
import warnings
from dataclasses import replace

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, NonlinearConstraint, minimize

from scripts.design_parts.robots import unlogged
from sysid.design import search, solve
from sysid.design.columns import with_changes
from sysid.design.problem import torque

ROBOTS = ("planar", "leg", "ur5", "panda")
_ROUNDS = 2
_LIMIT = 60.0  # s of processor time of the others


class _Late(Exception):
    """A solver has had its time."""


def case(seed: int, number: int, robots=ROBOTS) -> dict:
    """Robot and seed of a comparison."""
    return {"robot": robots[number % len(robots)], "seed": seed + number // len(robots)}


def trial(case: dict) -> dict:
    """What each solver makes of a start: what its motion is worth once it keeps to every limit at a
    kilohertz, and the CPU seconds. Without distances, which have corners that others cannot take."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        problem, pose, _ = unlogged(case["robot"])
        shapes = problem.geometry.shapes.copy()
        shapes.removeAllCollisionPairs()
        problem = replace(problem, geometry=replace(problem.geometry, shapes=shapes))
        start = search.start(problem, pose, (case["seed"], _ROUNDS, 0))
        problem = problem.with_rounds(_ROUNDS)
        told = {**case, "start": start.value, "solvers": {}}
        for name, solver in SOLVERS.items():
            begun = time.process_time()
            ends, looks = solver(problem, start.z)
            spent = time.process_time() - begun
            best = max(solve.Found.of(problem, z).value for z in ends)
            told["solvers"][name] = {"worth": best, "cpu": spent, "looks": looks}
    return told


def _programs(problem, z):
    climb = solve.climbed(problem, solve.Climb(problem.family, z), sum(solve.STEPS))
    return [climb.z], None


class _Others:
    """The problem as general solvers want it: what a motion is worth at the nodes with its slope, the
    linear limits as rows, torque with its slope. Keeps the best point that passes no limit."""

    def __init__(self, problem, z, seconds):
        self.problem, self.shape, self.seconds = problem, z.shape, seconds
        self.grid = solve._grid(problem, np.zeros(0))
        self.begun, self.looks, self.best = time.process_time(), 0, (-np.inf, z)
        self.at, self.last = None, None

    def look(self, flat):
        """A look at a point, kept until the next."""
        if self.last is None or not np.array_equal(flat, self.last):
            if time.process_time() - self.begun > self.seconds:
                raise _Late
            self.last, self.looks = np.array(flat), self.looks + 1
            self.at = solve._look(self.problem, self.last.reshape(self.shape), self.grid)
            if self.at.beyond < 1e-3 and self.at.worth > self.best[0]:
                self.best = self.at.worth, self.at.z
        return self.at

    def ends(self, flat) -> list[np.ndarray]:
        """Where a solver ended, and the best point on its way that passed no limit."""
        return [np.asarray(flat).reshape(self.shape), self.best[1]]

    def cost(self, flat) -> float:
        return -self.look(flat).worth

    def slope(self, flat) -> np.ndarray:
        return -solve.climbs(self.problem, self.look(flat), self.grid).ravel()

    def rows(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(matrix, low, high) of positions, speeds, accelerations and jerks, as shares."""
        own, (dof, size) = self.problem.limits, self.shape
        out, middle = [], []
        for reach, most in zip(
            self.grid.basis, (own.half, own.velocity, own.acceleration, own.jerk)
        ):
            for j in range(dof):
                part = np.zeros((len(reach), dof, size))
                part[:, j] = reach / most[j]
                out.append(part.reshape(len(reach), -1))
                centre = own.middle[j] / most[j] if most is own.half else 0.0
                middle.append(np.full(len(reach), centre))
        matrix, middle = np.concatenate(out), np.concatenate(middle)
        return matrix, middle - 1.0, middle + 1.0

    def torques(self, flat) -> np.ndarray:
        own = self.problem.limits.torque
        limited = np.isfinite(own)
        return (self.look(flat).torque[:, limited] / own[limited]).T.ravel()

    def torque_slopes(self, flat) -> np.ndarray:
        own, dof = self.problem.limits.torque, self.shape[0]
        motion = self.look(flat).motion[:3]
        _, change = with_changes(lambda *asked: torque(self.problem, *asked).T, *motion)
        slopes = [
            np.einsum("rin,rnz->niz", change[j].reshape(3, dof, -1) / own[j], self.grid.basis[:3])
            for j in np.flatnonzero(np.isfinite(own))
        ]
        return np.concatenate([s.reshape(len(s), -1) for s in slopes])


def _scipy(method: str):
    def solver(problem, z):
        posed = _Others(problem, z, _LIMIT)
        matrix, low, high = posed.rows()
        limits = [LinearConstraint(matrix, low, high)]
        if np.isfinite(problem.limits.torque).any():
            limits.append(NonlinearConstraint(posed.torques, -1.0, 1.0, jac=posed.torque_slopes))
        options = {"maxiter": 200} | (
            {"gtol": 1e-4} if method == "trust-constr" else {"ftol": 1e-2}
        )
        try:
            found = minimize(
                posed.cost, z.ravel(), jac=posed.slope, method=method, constraints=limits,
                bounds=Bounds(-10.0, 10.0), options=options,
            )  # fmt: skip
            return posed.ends(found.x), posed.looks
        except _Late:
            return posed.ends(posed.last), posed.looks

    return solver


def _ipopt(problem, z):
    """CasADi's IPOPT with the same functions and slopes, its Hessian by limited memory."""
    import casadi

    posed = _Others(problem, z, _LIMIT)
    matrix, low, high = posed.rows()
    limited = bool(np.isfinite(problem.limits.torque).any())
    count = int(np.isfinite(problem.limits.torque).sum()) * len(posed.grid.basis[0])
    failed: list[Exception] = []

    class Own(casadi.Callback):
        """A function of the coordinates with its Jacobian."""

        def __init__(self, name, rows, value, jacobian):
            casadi.Callback.__init__(self)
            self.rows_out, self.value, self.jacobian_of, self.inner = rows, value, jacobian, None
            self.construct(name, {})

        def get_n_in(self):
            return 1

        def get_n_out(self):
            return 1

        def get_sparsity_in(self, i):
            return casadi.Sparsity.dense(z.size, 1)

        def get_sparsity_out(self, i):
            return casadi.Sparsity.dense(self.rows_out, 1)

        def eval(self, given):
            try:
                return [casadi.DM(self.value(np.array(given[0]).ravel()))]
            except _Late as error:
                failed.append(error)
                raise

        def has_jacobian(self):
            return True

        def get_jacobian(self, name, inames, onames, opts):
            outer = self

            class Slope(casadi.Callback):
                """The Jacobian of its owner."""

                def __init__(self):
                    casadi.Callback.__init__(self)
                    self.construct(name, {})

                def get_n_in(self):
                    return 2

                def get_n_out(self):
                    return 1

                def get_sparsity_in(self, i):
                    return casadi.Sparsity.dense(z.size if i == 0 else outer.rows_out, 1)

                def get_sparsity_out(self, i):
                    return casadi.Sparsity.dense(outer.rows_out, z.size)

                def eval(self, given):
                    own = outer.jacobian_of(np.array(given[0]).ravel())
                    return [casadi.DM(own.reshape(outer.rows_out, z.size))]

            self.inner = Slope()
            return self.inner

    x = casadi.MX.sym("x", z.size)
    cost = Own("cost", 1, posed.cost, posed.slope)
    parts, lower, upper = [casadi.mtimes(casadi.DM(matrix), x)], [low], [high]
    if limited:
        strong = Own("strong", count, posed.torques, posed.torque_slopes)
        parts.append(strong(x))
        lower.append(-np.ones(count))
        upper.append(np.ones(count))
    asked = {
        "ipopt.hessian_approximation": "limited-memory", "ipopt.print_level": 0, "print_time": False,
        "ipopt.max_cpu_time": _LIMIT, "ipopt.max_iter": 200, "ipopt.tol": 1e-4,
        "ipopt.sb": "yes",
    }  # fmt: skip
    solver = casadi.nlpsol("s", "ipopt", {"x": x, "f": cost(x), "g": casadi.vertcat(*parts)}, asked)
    try:
        found = solver(x0=z.ravel(), lbg=np.concatenate(lower), ubg=np.concatenate(upper))
        return posed.ends(np.array(found["x"])), posed.looks
    except RuntimeError:
        if not failed:
            raise
    return posed.ends(posed.last), posed.looks


SOLVERS = {
    "linear programs": _programs, "SLSQP": _scipy("SLSQP"), "trust-constr": _scipy("trust-constr"),
    "IPOPT": _ipopt,
}  # fmt: skip


if importlib.util.find_spec("casadi") is None:  # `pip install casadi` for the fourth
    del SOLVERS["IPOPT"]


def table(results: list[dict]) -> list[str]:
    """Worth above the start's and CPU seconds, by robot and solver."""
    out = ["robot    " + "".join(f"{name:>28s}" for name in SOLVERS)]
    for r in results:
        cells = [
            f"{own['worth'] - r['start']:+.1f} in {own['cpu']:.1f} s"
            for own in r["solvers"].values()
        ]
        out.append(f"{r['robot']:9s}" + "".join(f"{cell:>28s}" for cell in cells))
    return out
