"""The optimum of a problem that differs a little from one whose optimum is known.

Under a log-det prior every body is possible at the optimum by the prior's own barrier, so that
near an optimum the objective in the physical parameters is smooth and strictly convex, and
Newton's method needs two or three steps where an interior-point method, which cannot begin
anywhere near an end, needs ten. Coefficients that may not fall below zero are held there, or let
go again, as the objective asks.

Source: Boyd & Vandenberghe 2004, 9.5 (Newton's method) and 9.6 (self-concordance); Nocedal &
Wright 2006, 16.5 (active sets).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from .objective import Objective, add_blocks

_STEPS, _HALVINGS = 10, 3  # more, and it is not near
_ROUNDING = 1e-13  # share of the objective that a step cannot be told to promise
_AT_ZERO = 1e-9  # share of the objective that taking a coefficient to zero may cost


def from_nearby(
    objective: Objective, positive, held, start, *, tolerance: float
) -> np.ndarray | None:
    """The optimum (size,), or None where it is not near: another method has to find it.

    Args:
        objective: with a barrier.
        positive, held: (coefficients,) bool, as in the solver's coordinates.
        start: (size,) the optimum of a problem like this one, strictly possible.
        tolerance: its square is the share of the objective that a last step may promise.
    """
    count, x = 10 * objective.bodies, np.array(start, dtype=float)
    data, rows, target = objective.data_hessian(), *np.split(objective.triangle, [-1], axis=1)
    bound = np.concatenate([np.zeros(count, dtype=bool), positive & ~held])
    held = np.concatenate([np.zeros(count, dtype=bool), held])
    value = objective.value(x)
    zero = bound & (0.5 * np.diagonal(data) * x**2 <= _AT_ZERO * value)
    for _ in range(_STEPS):
        slope = 2.0 * ((rows @ x - target[:, 0]) @ rows)
        own = objective.divergence.gradient(x[:count].reshape(-1, 10))
        slope[:count] += objective.weight * own.ravel()
        zero &= slope >= 0.0  # what is held at zero is let go where the objective falls from there
        step = _newton(add_blocks(data.copy(), objective.prior_hessian(x)), slope, held | zero)
        if step is None:
            return None
        promise = -0.5 * float(slope @ step)
        below = bound & ~zero & (x + step < 0.0)
        moved = None
        for halving in range(_HALVINGS + 1):
            trial = x + 0.5**halving * step
            trial[below] = 0.0
            after = objective.value(trial)
            if after < value * (1.0 + _AT_ZERO):
                moved = trial
                break
        if moved is None:
            return None
        x, value, zero = moved, after, zero | below
        if promise <= max(tolerance**2, _ROUNDING) * value and not below.any():
            return x
    return None


def _newton(system, slope, stays) -> np.ndarray | None:
    """The step (size,) to the least of a quadratic, zero where a parameter stays."""
    right = np.where(stays, 0.0, -slope)
    system[stays, :] = system[:, stays] = 0.0
    system[stays, stays] = 1.0
    factor, fault = dpotrf(system, lower=1)
    return None if fault else dpotrs(factor, right, lower=1)[0]
