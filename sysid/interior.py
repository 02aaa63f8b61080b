"""The convex problem solved where it is convex: a primal-dual interior-point method in the physical parameters.

Newton in log-Cholesky coordinates crawls where the data bend a long, narrow valley towards the boundary of the
possible bodies (six joints with a weak prior do that). There the same problem, written as

    minimise ||R [x; -1]||^2 + quadratic and linear parts of the prior,   J_b(x) > 0,  c_i >= 0,

with multipliers Z_b of the bodies and z_i of the coefficients, has its optimum at J_b Z_b = gamma 1 for the
log-det prior (its barrier is the prior) and at J_b Z_b = 0 for the others. Nesterov-Todd scaling makes a body and
its multiplier the same diagonal matrix, so each step is one small symmetric system, solved twice: where does the
straight way lead, and how is it best bent. Far from the optimum the straight way soon ends at the boundary, and the bend of all
of it can lead round and round: where a step would leave much more complementarity than there was, as much of the bend is taken
as the straight way goes.

Source: Vandenberghe 2010, "The CVXOPT linear and quadratic cone program solvers"; Mehrotra 1992 (predictor-corrector); Salahi,
Peng & Terlaky 2007 (where it fails); Colombo & Gondzio 2008 (a part of the bend).
"""

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from .central_path import State, aimed, changed, gaps, reach, scale, scaled_columns, scaled_gradient, scaling, stepped
from .inertia.pseudo import to_pseudo
from .objective import Objective, add_blocks
from .symmetric_matrices import packed

# Share of the way to the boundary that a step must leave; near the end less, or the end comes two digits at a time.
_LEAVE, _LEAST, _PER_GAP = 1e-2, 1e-6, 1e4
_START = 0.1  # of the objective, each parameter's share: complementarity to begin with; with less, steps soon end at the boundary
_GROWS = 2.0  # times the complementarity, or what is aimed at: a step that leaves more may lead round and round
_POOR = 0.5  # a step of less than this share of its length is tried again without its bend
_NEARLY = 1e-9  # the same, where the next step breaks down
_FAINT = 1e-9  # of the torque: what a coefficient at nought may make of it where a search begins
_NOTHING = 1e-12  # share of the objective that complementarity may leave at a bound


@np.errstate(over="ignore", invalid="ignore", divide="ignore")  # numbers that are none end the search
def minimise(objective: Objective, positive: np.ndarray, held: np.ndarray, start: np.ndarray, *, tolerance: float, max_iterations: int = 100):
    """Minimise from a strictly possible x = start (size,).

    Args:
        positive, held: (coefficients,) bool, as in the solver's coordinates.

    Returns:
        the iterates [x (size,), ...], the start included; the objective at each; whether the last one converged.
    """
    count = 10 * objective.bodies
    free, bound = ~held, positive & ~held
    rows, target = objective.triangle[:, :-1], objective.triangle[:, -1]
    linear, quadratic, barriers = _prior_parts(objective)
    barrier = objective.barrier
    x = _inside(start, rows, target, bound, count)
    iterates, values, best, near = [x], [objective.value(x)], np.inf, False
    mu = max(_START * values[0] / len(x), float(barriers.max()))
    z = np.maximum(_START * values[0] / len(x), barriers)[:, :, None] * np.linalg.inv(to_pseudo(x[:count].reshape(-1, 10)))
    # bodies whose barriers weigh more and less come to their levels at their own pace
    every = {"axis": 1, "keepdims": True} if np.ptp(barriers) > 0.0 else {}
    state = State(x, z, np.where(bound, mu / np.where(bound, x[count:], 1.0), 0.0))
    unit = np.concatenate([np.ones(count), np.where(bound, 1.0, 0.0)])
    size = 4 * objective.bodies + int(bound.sum())
    fixed = count + np.flatnonzero(held)
    for _ in range(max_iterations + 1):
        value = max(abs(values[-1]), np.finfo(float).tiny)
        floor_c = _NOTHING * value / len(x)
        floor_j = barriers if barrier else floor_c
        try:
            scaled = scale(state, count, bound)
        except np.linalg.LinAlgError:
            # the last step left what double precision can tell from the boundary; the one before may be the answer
            if near:
                return iterates[:-1], values[:-1], True
            break
        turn = scaling(scaled.factors)
        image = scaled_columns(rows, turn, scaled.spread)
        system = image.T @ image
        system *= 2.0
        slope = scaled_gradient(2.0 * ((rows @ state.x - target) @ rows) + linear, turn, scaled.spread)
        if quadratic is not None:
            add_blocks(system, np.swapaxes(turn, -1, -2) @ quadratic @ turn)
            away = (state.x[:count] - objective.divergence.prior.ravel()).reshape(-1, 10, 1)
            slope[:count] += (np.swapaxes(turn, -1, -2) @ (quadratic @ away)).ravel()
        system.flat[:: len(x) + 1] += unit
        if fixed.size:
            system[fixed, :] = system[:, fixed] = 0.0
            system[fixed, fixed] = 1.0
        solve = _solver(system)
        squares_c = np.where(bound, scaled.root**2, 0.0)
        # the objective is off by about gamma off^2
        off = np.max(np.abs(scaled.weights**2 - floor_j) / floor_j) if barrier else 0.0
        loose = squares_c.sum() + (0.0 if barrier else np.sum(scaled.weights**2))
        near = False
        if off < 1e-4 and loose <= _NEARLY * value:
            residual = slope - np.concatenate([packed(scaled.weights), np.where(bound, scaled.root, 0.0)])
            residual[fixed] = 0.0
            small = 0.5 * residual @ solve(residual)
            near = small <= _NEARLY * value
            if small <= max(tolerance**2, 1e-13) * value and loose <= 4.0 * _NOTHING * value:
                # the last steps cost little and take the gradient to where only rounding is left
                if barrier or small > 0.1 * best:
                    return iterates, values, True
                best = small
        # predictor: straight for the final targets; how far it gets sets how far the corrector aims
        straight = changed(solve, slope, scaled, aimed(scaled, bound, floor_j, floor_c, None), fixed, bound)
        if not np.isfinite(straight.both).all():  # a body is so thin that nothing is left of its metric: what was found stands
            break
        ahead = (1.0 - min(1.0, reach(straight, scaled, bound))) ** 3
        mu_j, mu_c = np.mean(scaled.weights**2, **every), squares_c.sum() / max(int(bound.sum()), 1)
        if not barrier:
            mu_j = mu_c = (np.sum(scaled.weights**2) + squares_c.sum()) / size
        # bodies under a barrier stay at its weight, however little is left of the coefficients' complementarity
        levels = np.maximum(ahead * mu_j, floor_j), max(ahead * mu_c, floor_c)
        change = changed(solve, slope, scaled, aimed(scaled, bound, *levels, straight), fixed, bound)
        keep = 1.0 - np.clip(_PER_GAP * loose / value, _LEAST, _LEAVE)
        length = min(1.0, keep * reach(change, scaled, bound))
        if length < _POOR:
            # far from the path the predictor knows nothing of the bend; without it the step may go further
            plain = changed(solve, slope, scaled, aimed(scaled, bound, *levels, None), fixed, bound)
            further = min(1.0, keep * reach(plain, scaled, bound))
            if further > length:
                change, length = plain, further
        most = _GROWS * np.maximum(gaps(scaled, bound), (4.0 * np.sum(levels[0] + 0.0 * scaled.weights[:, :1]), levels[1] * bound.sum()))
        if (gaps(scaled, bound, change, length) > most).any():
            # the bend is that of the whole straight way; where this ends early, so does the bend
            aim = aimed(scaled, bound, *levels, straight, share=min(1.0, reach(straight, scaled, bound)))
            change = changed(solve, slope, scaled, aim, fixed, bound)
            length = min(1.0, keep * reach(change, scaled, bound))
            while (gaps(scaled, bound, change, length) > most).any():
                length *= 0.5
        if not np.isfinite(change.both).all():
            break
        state = stepped(state, turn, scaled, change, length, bound, free, count)
        iterates.append(state.x)
        values.append(objective.value(state.x))
    # not converged: what was best stands last
    last = int(np.argmin(values))
    return iterates[: last + 1], values[: last + 1], False


def _inside(start, rows, target, bound, count: int) -> np.ndarray:
    """A start whose bounded coefficients are not nought, to the last digit that tells anything of the torque: where a search in
    logarithms ends, there is no multiplier that belongs to nought."""
    x = np.array(start, dtype=float)
    size, column = np.linalg.norm(target), np.linalg.norm(rows[:, count:], axis=0)
    least = _FAINT * np.where(column > 0.0, size / np.where(column > 0.0, column, 1.0), 1.0)
    x[count:] = np.where(bound, np.maximum(x[count:], np.maximum(least, np.finfo(float).tiny)), x[count:])
    return x


def _prior_parts(objective: Objective):
    """gamma times the prior without its barrier: linear (size,), quadratic (bodies, 10, 10) or None, the barrier's weights (bodies, 1)."""
    linear, none = np.zeros(objective.triangle.shape[1] - 1), np.zeros((objective.bodies, 1))
    if objective.weight == 0.0:
        return linear, None, none
    if objective.barrier:
        linear[: 10 * objective.bodies] = objective.weight * objective.divergence.linear.ravel()
        return linear, None, none + objective.weight * np.reshape(objective.divergence.scale, (-1, 1))
    return linear, objective.weight * np.asarray(objective.divergence.hessian(objective.divergence.prior)), none


def _solver(system):
    """Solve with one factorization; by least squares where rounding made the system singular."""
    factor, fault = dpotrf(system, lower=1)
    if fault == 0:
        return lambda right: dpotrs(factor, right, lower=1)[0]
    return lambda right: np.linalg.lstsq(system, right, rcond=1e-14)[0]
