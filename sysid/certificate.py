"""Is it the global optimum? The problem is convex in the physical parameters, so one point can prove it.

A bound on F(x) - F* follows from the gradient at x alone. It is split into a part that pushes against a bound
and a rest:

- A coefficient that must not be negative can take at most G_i c_i off the objective where G_i > 0.
- Without a barrier the bodies' boundary is such a bound too: the part of the gradient that is a positive matrix P
  on J can take off at most <P, J>.
- For the rest, F is a quadratic (at most G' H^+ G / 2), or, with a log-det prior, F / gamma is self-concordant: with
  the Newton decrement lambda = sqrt(G' H^-1 G / gamma) < 1 at most gamma (-lambda - log(1 - lambda)).

All of it is computed in coordinates in which every body (or its prior) is the unit matrix, so that a thin link
loses no digits.

Source: Boyd & Vandenberghe 2004, section 9.6 (decrement); Nesterov & Nemirovskii 1994 (bound).
"""

from dataclasses import dataclass

import numpy as np

from . import eigen
from .central_path import scaled_columns, scaled_gradient, scaling
from .inertia.pseudo import to_pseudo
from .objective import Objective, add_blocks
from .symmetric_matrices import coordinates, packed, unpacked

# What counts as proven: the objective is within this share of the global minimum.
_PROVEN = 1e-8


@dataclass(frozen=True)
class Certificate:
    """Proof of a global optimum.

    gap: a bound on F(x) - F*, over F(x). stationarity: the gradient that no bound explains, in the metric of the
    inverse Hessian, over sqrt(F): dimensionless. at_zero: coefficients at their bound of zero, with the
    gradient there [objective per unit]; positive means that the bound, not the search, holds them.
    """

    globally_optimal: bool
    gap: float
    stationarity: float
    at_zero: dict[int, float]


def certify(objective: Objective, x: np.ndarray, positive: np.ndarray, held: np.ndarray, *, constrained: bool = True) -> Certificate:
    """Certify x (size,).

    Args:
        positive, held: (coefficients,) bool, as in the solver's coordinates.
        constrained: False where bodies may be impossible (the linear parameterization).
    """
    count, value = 10 * objective.bodies, objective.value(x)
    pi, c = x[:count].reshape(-1, 10), x[count:]
    barrier = constrained and objective.barrier
    try:
        pseudo = to_pseudo(pi)
        if constrained:
            np.linalg.cholesky(pseudo)
        # a barrier is exact where every body is the unit matrix; a quadratic, where the prior is
        factors = np.linalg.cholesky(pseudo if barrier else to_pseudo(objective.divergence.prior))
    except np.linalg.LinAlgError:
        return Certificate(False, np.inf, np.inf, {})
    spread = np.where(positive & (c > 0.0), c, 1.0)
    turn = scaling(factors)
    image = scaled_columns(objective.triangle[:, :-1], turn, spread)
    slope = 2.0 * image.T @ objective.misfit(x)
    hessian = 2.0 * image.T @ image
    own = np.arange(count)
    # of each body: what is added to any stays as self-concordant by the least of them
    barriers = objective.weight * np.broadcast_to(objective.divergence.scale, (objective.bodies,))
    if barrier:
        # in these coordinates the barrier's gradient is -1 and its Hessian 1, exactly
        linear = np.append(objective.divergence.linear.ravel(), np.zeros(len(c)))
        slope += objective.weight * scaled_gradient(linear, turn, spread)
        slope[:count] -= packed(barriers[:, None] * np.ones(4))
        hessian[own, own] += np.repeat(barriers, 10)
    elif objective.weight > 0.0:
        pull = np.append(objective.weight * objective.divergence.gradient(pi).ravel(), np.zeros(len(c)))
        slope += scaled_gradient(pull, turn, spread)
        add_blocks(hessian, np.swapaxes(turn, -1, -2) @ objective.prior_hessian(x) @ turn)
    # a bound explains a positive gradient where going all the way to it costs less curvature than it gains
    push = slope[count:]
    at_zero = positive & ~held & (push > 0.0) & (np.diagonal(hessian)[count:] < 0.5 * push)
    bound = float(np.sum(push[at_zero]))
    rest = slope.copy()
    rest[count:][at_zero | held] = 0.0
    if constrained and not barrier:
        # at an optimum on the boundary the gradient on J is a positive matrix that is flat where J is not
        matrices = unpacked(rest[:count])
        values, axes = eigen.symmetric(matrices)
        explained = (axes * np.clip(values, 0.0, None)[:, None, :]) @ np.swapaxes(axes, -1, -2)
        rest[:count] -= coordinates(explained).ravel()
        inverse = np.linalg.inv(factors)
        bound += float(np.sum(explained * (inverse @ pseudo @ np.swapaxes(inverse, -1, -2))))
    free = np.append(np.ones(count, dtype=bool), ~held & ~at_zero)
    decrement = _decrement(rest[free], hessian[np.ix_(free, free)], float(np.linalg.norm(objective.triangle[:, -1])))
    if barrier:
        least = barriers.min()
        scaled = np.sqrt(decrement / least)
        bound += least * (-scaled - np.log1p(-scaled)) if scaled < 1.0 else np.inf
    else:
        bound += 0.5 * decrement
    gap = bound / value if value > 0.0 else bound
    return Certificate(
        globally_optimal=bool(gap <= _PROVEN), gap=float(gap), stationarity=float(np.sqrt(decrement / value)) if value > 0 else 0.0,
        at_zero={int(k): float(push[k] / spread[k]) for k in np.flatnonzero(at_zero)},
    )  # fmt: skip


def _decrement(gradient, hessian, norm) -> float:
    """G' H^+ G; infinite where the gradient leaves the range of H by more than rounding."""
    scale = np.sqrt(np.where(np.diagonal(hessian) > 0, np.diagonal(hessian), 1.0))
    values, vectors = eigen.symmetric(hessian / np.outer(scale, scale))
    along = vectors.T @ (gradient / scale)
    flat = values < 1e-14 * values[-1]
    # R' r with |r| up to the data's norm is known to that norm times rounding; the search leaves a little more
    if np.any(np.abs(along[flat]) > 1e-9 * norm):
        return np.inf
    return float(np.sum(along[~flat] ** 2 / values[~flat]))

