"""The convex problem solved where it is convex: a primal-dual interior-point method in the physical parameters.

Newton in log-Cholesky coordinates crawls where the data bend a long, narrow valley towards the boundary of the
possible bodies (six joints with a weak prior do that). There the same problem, written as

    minimise ||R [x; -1]||^2 + quadratic and linear parts of the prior,   J_b(x) > 0,  c_i >= 0,

with multipliers Z_b of the bodies and z_i of the coefficients, has its optimum at J_b Z_b = gamma 1 for the
log-det prior (its barrier is the prior) and at J_b Z_b = 0 for the others. Nesterov-Todd scaling makes a body and
its multiplier the same diagonal matrix, so each step is one small symmetric system.

Source: Vandenberghe 2010, "The CVXOPT linear and quadratic cone program solvers"; Mehrotra 1992 (predictor).
"""

from dataclasses import dataclass

import numpy as np

from .inertia.pseudo import from_pseudo, to_pseudo
from .objective import Objective

_KEEP = 0.98  # share of the way to the boundary that a step may go
_NOTHING = 1e-12  # share of the objective that complementarity may leave at a bound

# orthonormal basis of symmetric 4 x 4 matrices: coordinates of a scaled change of a body
_BASIS = np.zeros((10, 4, 4))
for _k, (_i, _j) in enumerate(((0, 0), (1, 1), (2, 2), (3, 3), (0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))):
    _BASIS[_k, _i, _j] = _BASIS[_k, _j, _i] = 1.0 if _i == _j else np.sqrt(0.5)
_DIAGONAL = np.arange(4)


def scaling(factors: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """T (size, size): columns are the changes of x for unit changes F B_k F' of each body and of each coefficient."""
    count = 10 * len(factors)
    out = np.zeros((count + len(scales),) * 2)
    blocks = from_pseudo(factors[:, None] @ _BASIS @ np.swapaxes(factors, -1, -2)[:, None])  # (bodies, k, 10)
    for b, block in enumerate(blocks):
        out[10 * b : 10 * b + 10, 10 * b : 10 * b + 10] = block.T
    own = np.arange(count, len(out))
    out[own, own] = scales
    return out


@dataclass
class _State:
    x: np.ndarray
    z: np.ndarray  # (bodies, 4, 4)
    dual: np.ndarray  # (coefficients,), zero where a coefficient is free


def minimise(objective: Objective, positive: np.ndarray, held: np.ndarray, start: np.ndarray, *, tolerance: float, max_iterations: int = 100):
    """Minimise from a strictly possible x = start (size,).

    Args:
        positive, held: (coefficients,) bool, as in the solver's coordinates.

    Returns:
        the iterates [x (size,), ...], the start included and whether the last one converged.
    """
    count = 10 * objective.bodies
    free = np.append(np.ones(count, dtype=bool), ~held)
    bound = positive & ~held
    root, target = objective.triangle[:, :-1], objective.triangle[:, -1]
    linear, quadratic, barrier = _prior_parts(objective)
    x = np.array(start, dtype=float)
    iterates, best = [x], np.inf
    floor_j = barrier  # where J Z must end; without a barrier it goes to nothing, as c z does
    mu = max(0.1 * objective.value(x) / len(x), floor_j)
    pseudo = to_pseudo(x[:count].reshape(-1, 10))
    state = _State(x, mu * np.linalg.inv(pseudo), np.where(bound, mu / np.where(bound, x[count:], 1.0), 0.0))
    for _ in range(max_iterations + 1):
        value = max(abs(objective.value(state.x)), np.finfo(float).tiny)
        floor_c = _NOTHING * value / len(x)
        floor_j = barrier or floor_c
        try:
            factors, weights, spread, root_c = _scaled(state, count, bound)
        except np.linalg.LinAlgError:
            # the last step left what double precision can tell from the boundary
            return iterates[:-1] or iterates, False
        turn = scaling(factors, spread)
        image = root @ turn
        system = 2.0 * image.T @ image
        if quadratic is not None:
            for b, block in enumerate(quadratic):
                own = slice(10 * b, 10 * b + 10)
                system[own, own] += turn[own, own].T @ block @ turn[own, own]
        own = np.arange(len(state.x))
        system[own, own] += np.append(np.ones(count), np.where(bound, 1.0, 0.0))
        slope = 2.0 * image.T @ (root @ state.x - target) + turn.T @ linear
        if quadratic is not None:
            step = np.einsum("bij,bj->bi", quadratic, (state.x[:count] - objective.divergence.prior.ravel()).reshape(-1, 10))
            slope += turn.T @ np.append(step.ravel(), np.zeros(len(bound)))
        system[~free, :] = system[:, ~free] = 0.0
        system[~free, ~free] = 1.0
        size = weights.size + int(bound.sum())
        mu = (np.sum(weights**2) + np.sum(root_c[bound] ** 2)) / size
        off = max(np.abs(weights**2 - floor_j).max() / floor_j if barrier else 0.0, 0.0)
        residual = slope - np.append(packed(weights), np.where(bound, root_c, 0.0))
        residual[~free] = 0.0
        small = 0.5 * residual @ _solve(system, residual)
        loose = np.sum(root_c[bound] ** 2) + (0.0 if barrier else np.sum(weights**2))
        if off < 1e-6 and small <= max(tolerance**2, 1e-13) * value and loose <= 4.0 * _NOTHING * value:
            # the last steps cost little and take the gradient to where only rounding is left
            if barrier or small > 0.1 * best:
                return iterates, True
            best = small
        # predictor: as far as the final targets allow; its success sets how far to aim
        aim = lambda level: np.append(packed(np.maximum(level, floor_j) / weights), np.where(bound, max(level, floor_c) / np.where(bound, root_c, 1.0), 0.0))  # noqa: E731, B023
        step = _solve(system, np.where(free, aim(0.0) - slope, 0.0))
        reach = _reach(step, aim(0.0), weights, root_c, bound, count)
        sigma = (1.0 - min(1.0, reach)) ** 3
        step = _solve(system, np.where(free, aim(sigma * mu) - slope, 0.0))
        reach = _reach(step, aim(sigma * mu), weights, root_c, bound, count)
        length = min(1.0, _KEEP * reach)
        state = _moved(state, turn, factors, weights, root_c, spread, step, aim(sigma * mu), length, bound, count)
        iterates.append(state.x)
    return iterates, False


def _prior_parts(objective: Objective):
    """gamma times the prior without its barrier: linear (size,), quadratic (bodies, 10, 10) or None, barrier weight."""
    linear = np.zeros(objective.triangle.shape[1] - 1)
    if objective.weight == 0.0:
        return linear, None, 0.0
    if objective.divergence.barrier:
        linear[: 10 * objective.bodies] = objective.weight * objective.divergence.linear.ravel()
        return linear, None, objective.weight
    return linear, objective.weight * np.asarray(objective.divergence.hessian(objective.divergence.prior)), 0.0


def _scaled(state: _State, count: int, bound):
    """Nesterov-Todd: F with F^-1 J F^-T = F' Z F = diag(weights); for coefficients sqrt(c / z) and sqrt(c z)."""
    lower = np.linalg.cholesky(to_pseudo(state.x[:count].reshape(-1, 10)))
    upper = np.linalg.cholesky(state.z)
    _, weights, vt = np.linalg.svd(np.swapaxes(upper, -1, -2) @ lower)
    factors = lower @ np.swapaxes(vt, -1, -2) / np.sqrt(weights)[:, None, :]
    c, dual = state.x[count:], state.dual
    spread = np.where(bound, np.sqrt(np.where(bound, c, 1.0) / np.where(bound, dual, 1.0)), 1.0)
    return factors, weights, spread, np.where(bound, np.sqrt(np.where(bound, c * dual, 1.0)), 1.0)


def packed(diagonals) -> np.ndarray:
    """Diagonal matrices (bodies, 4) in the basis, (10 bodies,)."""
    out = np.zeros((len(diagonals), 10))
    out[:, :4] = diagonals
    return out.ravel()


def unpacked(vector) -> np.ndarray:
    """Symmetric matrices (bodies, 4, 4) of coordinates (10 bodies,)."""
    return np.einsum("bk,kij->bij", vector.reshape(-1, 10), _BASIS)


def coordinates(matrices) -> np.ndarray:
    """Symmetric matrices (..., 4, 4) in the orthonormal basis (..., 10)."""
    return np.einsum("...ij,kij->...k", matrices, _BASIS)


def _solve(system, right):
    from scipy.linalg.lapack import dposv

    _, solution, fault = dposv(system, right, lower=1)
    return solution if fault == 0 else np.linalg.lstsq(system, right, rcond=1e-14)[0]


def _reach(step, aim, weights, root_c, bound, count) -> float:
    """How far along a step the bodies and their multipliers, and the coefficients and theirs, stay positive."""
    inverse = 1.0 / np.sqrt(weights)
    change = unpacked(step[:count])
    dual = unpacked(aim[:count]) - change
    dual[:, _DIAGONAL, _DIAGONAL] -= weights
    worst = [np.linalg.eigvalsh(inverse[:, :, None] * m * inverse[:, None, :])[:, 0].min() for m in (change, dual)]
    own = step[count:][bound] / root_c[bound]
    worst += [own.min(initial=0.0), (aim[count:][bound] / root_c[bound] - 1.0 - own).min(initial=0.0)]
    return 1.0 / max(-min(worst), 1e-12)


def _moved(state, turn, factors, weights, root_c, spread, step, aim, length, bound, count) -> _State:
    x = state.x + length * (turn @ step)
    dual = unpacked(aim[:count] - step[:count])
    dual[:, _DIAGONAL, _DIAGONAL] -= weights
    scaled = length * dual
    scaled[:, _DIAGONAL, _DIAGONAL] += weights
    inverse = np.linalg.inv(factors)
    z = np.swapaxes(inverse, -1, -2) @ scaled @ inverse
    change = aim[count:] - root_c - step[count:]
    own = np.where(bound, (root_c + length * change) / spread, 0.0)
    return _State(x, 0.5 * (z + np.swapaxes(z, -1, -2)), own)
