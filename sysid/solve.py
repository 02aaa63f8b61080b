"""Trust-region Newton on the compressed problem, with the exact gradient and Hessian.

The unknowns are theta: ten coordinates of a parameterization for each body, the logarithm of every coefficient
that must not be negative, the rest themselves. With Gamma = dx/dtheta the Hessian is

    Gamma' (d2F/dx2) Gamma + sum_k (dF/dx_k) d2x_k/dtheta2.

In theta the data bend a long, narrow valley: stiff directions that are straight in x are curved in theta, and a
trust region that follows the curve crawls. When that begins, far from any doubt about the basin (there is only one),
the interior-point method of `interior` finishes from where Newton stands; so it does where the prior is no barrier and
the optimum lies on the boundary of the possible bodies, at infinity in theta. Both minimise the same objective, and
the certificate does not ask how its point was found.

The trust region is a ball of the affine-invariant metric on bodies, pulled back to theta, so that a step counts
the same for a heavy link and a small rotor, in any frame and unit. Each step minimises the quadratic model in that
ball, whose radius is met to five per cent (More & Sorensen 1983).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import interior, symmetric_matrices
from .central_path import scaled_columns, scaled_gradient
from .inertia.divergence import affine_metric
from .inertia.parameterization import Parameterization
from .inertia.pseudo import to_pseudo
from .objective import Objective, add_blocks
from .trust_region import within

_LARGEST_RADIUS = 1e6
# Objective differences below this share of the objective are rounding, not progress.
_ROUNDING = 1e-14
# Newton hands over after this many iterations at the latest, unless it is told never to.
_PATIENCE = 25
# A coefficient below this share of its natural size, pushed down further, has gone to zero.
_ZERO = 1e-10
# Without a prior, directions that no data see keep where they are: a ridge this small against the seen ones.
_UNSEEN = 1e-12
_TINIEST = 1e-300  # what stands for zero where a logarithm is taken


@dataclass(frozen=True)
class Coordinates:
    """theta <-> x for a model: `positive` (coefficients,) solved as exponentials, `held` (coefficients,) not at all."""

    parameterization: Parameterization
    bodies: int
    positive: np.ndarray
    held: np.ndarray

    def constrained(self, objective: Objective) -> bool:
        """Whether bodies are kept possible: by the coordinates, or by the objective's barrier."""
        return objective.barrier or self.parameterization.name != "linear"

    def physical(self, theta) -> np.ndarray:
        """x (size,) of theta (size,)."""
        count = 10 * self.bodies
        pi = self.parameterization.parameters(theta[:count].reshape(self.bodies, 10))
        with np.errstate(over="ignore"):  # an infinite coefficient has an infinite objective and is stepped back from
            c = np.where(self.positive, np.exp(np.where(self.positive, theta[count:], 0.0)), theta[count:])
            c = np.where(self.positive & (c <= _TINIEST), 0.0, c)
        return np.concatenate([pi.ravel(), c])

    def theta(self, x) -> np.ndarray:
        """theta (size,) of a possible x (size,); a positive coefficient of zero becomes a very small one."""
        count = 10 * self.bodies
        c = np.asarray(x[count:], dtype=float)
        logs = np.log(np.where(self.positive, np.maximum(c, 0.5 * _TINIEST), 1.0))
        inner = self.parameterization.inverse(x[:count].reshape(self.bodies, 10)).ravel()
        return np.concatenate([inner, np.where(self.positive, logs, c)])


@dataclass(frozen=True)
class Solution:
    """Where the search ended.

    trace: x at every iterate, the start included; the first `newton_iterations` are Newton's, the rest the
    interior-point method's.
    """

    x: np.ndarray
    objective: float
    iterations: int
    converged: bool
    trace: tuple[np.ndarray, ...]
    objectives: tuple[float, ...]
    newton_iterations: int


def solve(
    objective: Objective, coordinates: Coordinates, start: np.ndarray, *, tolerance: float, max_iterations: int, handover: float = 0.5,
    callback: Callable[[int, float], None] | None = None,
) -> Solution:  # fmt: skip
    """Minimise from theta = start (size,).

    Converged means: the quadratic model promises a relative decrease below tolerance squared, or below what
    double precision can resolve.

    Args:
        handover: Newton hands over to the interior-point method when the trust region, not the model, ends a step that
            promises less than this share of the objective; 0 for Newton alone.
    """
    problem = _Problem(objective, coordinates)
    theta = np.array(start, dtype=float)
    x = coordinates.physical(theta)
    value = objective.value(x)
    trace, values = [x], [value]
    constrained = coordinates.constrained(objective)
    inside = theta, x, value
    radius, converged, iteration = 1.0 if constrained else _LARGEST_RADIUS, False, 0
    while iteration < max_iterations:
        try:
            gradient, hessian, metric = problem.expand(theta, x)
        except np.linalg.LinAlgError:
            # a body so thin that rounding makes it impossible: on the boundary, which is not Newton's to search
            theta, x, value = inside
            break
        inside = theta, x, value
        step, promise, length = within(gradient, hessian, metric, radius, ridge=0.0 if objective.weight > 0.0 else _UNSEEN)
        trial = theta + step
        with np.errstate(all="ignore"):  # a step too far has no number for its objective, and is stepped back from
            trial_x = coordinates.physical(trial)
            trial_value = objective.value(trial_x) if np.isfinite(trial_x).all() else np.inf
        converged = promise <= max(tolerance**2, _ROUNDING) * abs(value) and length < radius
        before = radius
        ratio = (value - trial_value) / promise if np.isfinite(trial_value) and promise > 0.0 else -1.0
        if ratio < 0.25:
            radius = 0.25 * min(length, radius)
        elif ratio > 0.75 and length > 0.8 * radius:
            radius = min(3.0 * radius, _LARGEST_RADIUS)
        if ratio > 1e-4 or (converged and trial_value <= value):
            theta, x, value = trial, trial_x, trial_value
        iteration += 1
        trace.append(x)
        values.append(value)
        if callback:
            callback(iteration, value)
        crawling = promise < handover * abs(values[-2]) and (length > 0.99 * before or ratio < 0.25)
        if converged or (constrained and handover > 0.0 and (crawling or iteration >= _PATIENCE)):
            break
    newton = iteration
    if constrained and handover > 0.0 and iteration < max_iterations and not converged:
        iterates, found, converged = interior.minimise(
            objective, coordinates.positive, coordinates.held, x, tolerance=tolerance, max_iterations=max_iterations - iteration
        )
        for x, value in zip(iterates[1:], found[1:]):
            trace.append(x)
            values.append(value)
            iteration += 1
            if callback:
                callback(iteration, value)
        x, value = trace[-1], values[-1]
    return Solution(x, value, iteration, converged, tuple(trace), tuple(values), newton)


class _Problem:
    """Derivatives of the objective in theta, and the trust region's metric."""

    def __init__(self, objective: Objective, coordinates: Coordinates):
        self.objective, self.coordinates = objective, coordinates
        self.count = 10 * coordinates.bodies
        self.root = objective.triangle[:, :-1]
        # natural size of a coefficient: what alone would explain the data's norm
        norms = np.linalg.norm(self.root[:, self.count :], axis=0)
        self.natural = np.linalg.norm(objective.triangle[:, -1]) / np.where(norms > 0, norms, np.inf)
        prior = np.linalg.inv(to_pseudo(objective.divergence.prior))
        self.prior_metric = affine_metric(prior)

    def expand(self, theta, x):
        """Gradient, Hessian and metric (factors of its body blocks, scales of the coefficients)."""
        coordinates, objective, count = self.coordinates, self.objective, self.count
        blocks = theta[:count].reshape(-1, 10)
        gamma = coordinates.parameterization.jacobian(blocks)
        slope = objective.gradient(x)
        c, positive = x[count:], coordinates.positive
        chain = np.where(positive, c, 1.0)
        # (R Gamma)'(R Gamma), built from the triangle so that weak directions keep their digits
        image = scaled_columns(self.root, gamma, chain)
        hessian = 2.0 * image.T @ image
        pulled = coordinates.parameterization.hessian(blocks, slope[:count].reshape(-1, 10))
        if objective.weight:
            pulled = pulled + np.swapaxes(gamma, -1, -2) @ objective.prior_hessian(x) @ gamma
        add_blocks(hessian, pulled)
        own = np.arange(count, len(theta))
        hessian[own, own] += np.where(positive, slope[count:] * c, 0.0)
        gradient = scaled_gradient(slope, gamma, chain)
        at_zero = positive & (c < _ZERO * self.natural) & (slope[count:] > 0.0)
        frozen = own[at_zero | coordinates.held]
        gradient[frozen] = 0.0
        hessian[frozen, :] = hessian[:, frozen] = 0.0
        hessian[frozen, frozen] = 1.0
        scales = np.where(positive, 1.0, np.where(np.isfinite(self.natural), self.natural, 1.0))
        return gradient, hessian, (self._body_metric(x, gamma), scales)

    def _body_metric(self, x, gamma):
        """Cholesky factors L (bodies, 10, 10) of the affine-invariant metric in theta."""
        if self.coordinates.parameterization.name == "linear":
            return np.linalg.cholesky(self.prior_metric)  # the ten numbers may leave the possible bodies
        # J^-1/2 dJ J^-1/2 for every coordinate; the triangle of its QR is the metric's factor at half the digits' cost
        inverse = np.linalg.inv(np.linalg.cholesky(to_pseudo(x[: self.count].reshape(-1, 10))))[:, None]
        changes = inverse @ to_pseudo(np.swapaxes(gamma, -1, -2)) @ np.swapaxes(inverse, -1, -2)
        moved = np.swapaxes(symmetric_matrices.coordinates(changes), -1, -2)
        # a singular Jacobian (eigenvalue parameterization) must not make a direction free of charge
        size = np.linalg.norm(moved, axis=(1, 2))
        padded = np.concatenate([moved, 1e-4 * size[:, None, None] * np.eye(10)], axis=1)
        upper = np.linalg.qr(padded, mode="r")
        return np.swapaxes(upper, -1, -2)
