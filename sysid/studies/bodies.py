"""Section VI of the paper: 1000 random bodies, four ways to estimate each.

A free body under a known wrench; its velocities are measured with noise and bias; its ten parameters are estimated
from the residual wrenches of an implicit-midpoint discretization (eq. 13).

What the print leaves open, and what is read here (all of it can be changed, and docs/reproduction.md shows what
the other readings give):

- The wrench. Three of six components are printed, sin(t), sin(t + pi/3), sin(t + 2 pi/3). Read: `moment and force`, the
  printed three as the moment and the series continued, sin(t + pi), sin(t + 4 pi/3), sin(t + 5 pi/3), as the force.
  The other reading, `force only`, has no moment.
- Table I's second moments. Read: about the centre of mass (`com`), as in the eigenvalue construction of section III
  as Traversaro et al. have it. The other reading takes them about the body frame's origin (`origin`), where bodies
  are possible only if m |c|^2 is small enough; draws that are not are drawn again.
- The residual's wrench w_i is taken at the middle of the step, as the midpoint rule has it.
- "Width 0.05 about a mean of 0.1": uniform on [0.075, 0.125].
- MATLAB's lsqnonlin stops at 1e-6 in function, step and gradient; so does this. An iteration is one evaluation of the
  residual after the first.
"""

import time
from dataclasses import asdict, dataclass

import numpy as np

from ..inertia import PARAMETERIZATIONS, Eigenvalue, Exponential, is_consistent, violations
from ..inertia.divergence import Euclidean
from ..inertia.exponential import BASIS as EXPONENTIAL_BASIS
from ..inertia.pseudo import from_pseudo, rotational_inertia
from ..objective import Objective
from ..solve import Coordinates, solve
from .body_motions import IDENTITY, draw, measured

NONLINEAR = ("eigenvalue", "exponential", "log-cholesky")
MOST_ITERATIONS = 50


@dataclass(frozen=True)
class Reading:
    """How the paper's text is read, and what the solver is given."""

    about: str = "com"  # com | origin
    wrench: str = "moment and force"  # moment and force | force only
    jacobian: str = "analytic"  # analytic | differences
    tolerance: float = 1e-6
    series: int = 0  # terms of the exponential's power series, as section IV-A writes it; 0 for the exact map


class SeriesExponential(Exponential):
    """The exponential map cut off after some terms of its power series, with the exact Jacobian of what is left."""

    def __init__(self, terms: int):
        self._terms = terms

    def _sums(self, theta):
        q = self._symmetric(theta)
        term, change, total, slope = np.eye(4), np.zeros((10, 4, 4)), np.eye(4), np.zeros((10, 4, 4))
        for k in range(1, self._terms + 1):
            change = (change @ q + term @ EXPONENTIAL_BASIS) / k
            term = term @ q / k
            total, slope = total + term, slope + change
        return total, slope

    def parameters(self, theta):
        """pi (10,) of the truncated map, which need not be possible."""
        return from_pseudo(self._sums(theta)[0])

    def jacobian(self, theta):
        """Its Jacobian (10, 10)."""
        return from_pseudo(self._sums(theta)[1]).T


def _kind(name: str, reading: "Reading"):
    return SeriesExponential(reading.series) if name == "exponential" and reading.series else PARAMETERIZATIONS[name]()


def one(seed: int, index: int, reading: Reading) -> dict:
    """Draw, simulate and estimate one body every way. Everything but `seconds` is determined by the arguments."""
    rng = np.random.default_rng([seed, index])
    truth = draw(rng, reading.about)
    rows, target = measured(truth, rng, reading.wrench)
    linear = np.linalg.lstsq(rows, target, rcond=None)[0]
    result = {"truth": truth.tolist(), "linear": linear.tolist(), "cost_linear": _cost(rows, target, linear), "runs": {}, "newton": {}, "seconds": {}}
    for name in NONLINEAR:
        result["runs"][name], result["seconds"][name] = _trust_region(rows, target, name, reading)
        result["newton"][name] = _newton(rows, target, name)
    return result


def start(name: str) -> np.ndarray:
    """Coordinates (10,) at which a parameterization gives the identity."""
    if name == "eigenvalue":
        # every rotation does; the one without a turn is the natural one to write down
        return np.append(np.zeros(7), np.full(3, np.log(0.5)))
    return PARAMETERIZATIONS[name]().inverse(IDENTITY)


def _cost(rows, target, pi) -> float:
    return float(np.sum((rows @ pi - target) ** 2))


def _trust_region(rows, target, name: str, reading: Reading) -> tuple[dict, float]:
    from scipy.optimize import least_squares

    kind = _kind(name, reading)
    residual = lambda theta: rows @ kind.parameters(theta) - target  # noqa: E731
    jacobian = (lambda theta: rows @ kind.jacobian(theta)) if reading.jacobian == "analytic" else "2-point"
    begin = time.perf_counter()
    with np.errstate(all="ignore"):
        try:
            found = least_squares(
                residual, start(name), jac=jacobian, method="trf", max_nfev=MOST_ITERATIONS + 1,
                ftol=reading.tolerance, xtol=reading.tolerance, gtol=reading.tolerance,
            )  # fmt: skip
        except (ValueError, np.linalg.LinAlgError):
            # residuals that are no numbers: the search left what double precision can hold
            return {"iterations": MOST_ITERATIONS, "converged": False, "cost": None, "consistent": None}, 0.0
    seconds = time.perf_counter() - begin
    iterations = found.nfev - 1
    return {
        "iterations": int(iterations), "converged": bool(found.status > 0), "cost": float(2.0 * found.cost),
        "consistent": bool(is_consistent(kind.parameters(found.x))),
    }, seconds / max(iterations, 1)  # fmt: skip


def _newton(rows, target, name: str) -> dict:
    """The project's own solver, without a prior, from the same start."""
    triangle = np.linalg.qr(np.column_stack([rows, target]), mode="r")
    objective = Objective(triangle, Euclidean(IDENTITY[None]), 0.0)
    none = np.zeros(0, dtype=bool)
    coordinates = Coordinates(PARAMETERIZATIONS[name](), 1, none, none)
    found = solve(objective, coordinates, start(name), tolerance=1e-8, max_iterations=MOST_ITERATIONS)
    return {"iterations": found.iterations, "newton_iterations": found.newton_iterations, "converged": found.converged, "cost": found.objective}


def nonphysical(linear: np.ndarray) -> dict:
    """The breakdown that the paper's text gives, of linear estimates (bodies, 10).

    The counts are taken with the moments about the centre of mass, for which Theorem II.1 is equivalent to J > 0,
    and again (`about_origin`) with those about the frame's origin, as eq. 1 defines the inertia that the theorem is
    printed for: there a body can be impossible without a violation.
    """
    impossible = ~is_consistent(linear)
    origin, about_com = np.linalg.eigvalsh(rotational_inertia(linear)), violations(linear)
    mean = lambda values: float(np.mean(values)) if len(values) else None  # noqa: E731

    def counts(smallest, triangle):
        not_positive, violated = impossible & (smallest <= 0), impossible & (triangle <= 0)
        return {
            "inertia_not_positive": int(np.sum(not_positive)), "triangle_violated": int(np.sum(violated)),
            "mean_most_negative_moment": mean(smallest[not_positive]), "mean_triangle_violation": mean(triangle[violated]),
        }  # fmt: skip

    return {
        "nonphysical": float(np.mean(impossible)), "nonphysical_count": int(np.sum(impossible)),
        "negative_mass": int(np.sum(linear[:, 0] <= 0)),
        **counts(about_com["smallest_moment"], about_com["triangle"]),
        "about_origin": counts(origin[:, 0], origin[:, 0] + origin[:, 1] - origin[:, 2]),
    }  # fmt: skip


def summary(results: list[dict], reading: Reading, seed: int) -> dict:
    """The JSON document of `sysid study bodies`."""
    linear = np.array([result["linear"] for result in results])
    found = {"bodies": len(results), "seed": seed, "reading": asdict(reading), "linear": nonphysical(linear), "parameterizations": {}}
    best = np.min([[r["runs"][n]["cost"] if r["runs"][n]["cost"] is not None else np.inf for n in NONLINEAR] for r in results], axis=1)
    for name in NONLINEAR:
        runs = [result["runs"][name] for result in results]
        iterations = [run["iterations"] for run in runs]
        cost = np.array([np.inf if run["cost"] is None else run["cost"] for run in runs])
        newton = [result["newton"][name] for result in results]
        found["parameterizations"][name] = {
            "iterations": iterations,
            "median_iterations": float(np.median(iterations)),
            "range_90": [float(q) for q in np.percentile(iterations, [5, 95])],
            "failures": int(sum(not run["converged"] for run in runs)),
            # converged, yet not where another parameterization of the same body ended
            "stopped_elsewhere": int(np.sum([run["converged"] for run in runs] & (cost > best * (1 + 1e-3)))),
            "seconds_per_iteration": float(np.median([result["seconds"][name] for result in results])),
            "newton": {
                "median_iterations": float(np.median([run["iterations"] for run in newton])),
                "median_newton_iterations": float(np.median([run["newton_iterations"] for run in newton])),
                "failures": int(sum(not run["converged"] for run in newton)),
            },
        }  # fmt: skip
    return found


def sweep(seed: int, bodies: int = 20) -> list[dict]:
    """Near symmetric bodies: the same estimation, warm-started a little off the truth, as two moments meet.

    For each relative gap between two second moments: the median condition number of each Jacobian in its own
    coordinates at the truth, and the median iterations and failures from a start whose logarithms of moments are
    off by 0.1 and whose axes are turned by 0.5 rad.
    """
    rng = np.random.default_rng([seed, 1_000_000])
    cases = []
    for _ in range(bodies):
        cases.append((rng.uniform(0.2, 1.0), rng.uniform(-0.2, 0.2, 3), rng.uniform(0.2, 1.0, 2), rng.normal(size=3), rng.normal(size=(2, 3)), rng.integers(2**31)))
    out = []
    for gap in (1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 0.0):
        entry: dict = {"gap": gap, "condition": {}, "median_iterations": {}, "failures": {}}
        conditions, iterations, failures = ({name: [] for name in NONLINEAR} for _ in range(3))
        for mass, com, (first, third), beta, (off, tilt), noise in cases:
            moments = np.array([first, first * (1.0 + gap), third])
            phi = np.concatenate([[np.log(mass)], com, beta, np.log(moments)])
            pi = Eigenvalue().parameters(phi)
            rows, target = measured(pi, np.random.default_rng(noise), "moment and force")
            near = phi.copy()
            near[7:] += 0.1 * off
            near[4:7] += 0.5 * tilt / np.linalg.norm(tilt)
            begin = Eigenvalue().parameters(near)
            for name in NONLINEAR:
                kind = PARAMETERIZATIONS[name]()
                at = phi if name == "eigenvalue" else kind.inverse(pi)
                with np.errstate(divide="ignore"):
                    conditions[name].append(np.linalg.cond(kind.jacobian(at)))
                theta = near if name == "eigenvalue" else kind.inverse(begin)
                run = _from(rows, target, kind, theta)
                iterations[name].append(run.nfev - 1)
                failures[name].append(run.status <= 0)
        for name in NONLINEAR:
            condition = float(np.median(conditions[name]))
            entry["condition"][name] = condition if np.isfinite(condition) and condition < 1e15 else None  # None: singular
            entry["median_iterations"][name] = float(np.median(iterations[name]))
            entry["failures"][name] = int(np.sum(failures[name]))
        out.append(entry)
    return out


def _from(rows, target, kind, theta):
    from scipy.optimize import least_squares

    return least_squares(
        lambda x: rows @ kind.parameters(x) - target, theta, jac=lambda x: rows @ kind.jacobian(x), method="trf",
        max_nfev=MOST_ITERATIONS + 1, ftol=1e-6, xtol=1e-6, gtol=1e-6,
    )  # fmt: skip
