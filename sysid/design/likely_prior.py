"""How near to the URDF's bodies the training logs are likeliest to make them: the weight that a prior
has by that.

Of bodies that differ from the URDF's by d, with a density in proportion to exp(-weight d' P d / 4 s^2), and
coefficients of which nothing is known, what is measured beyond the URDF's torque, every joint in units of
its own noise, is normal: in directions u that coefficients leave, with b the singular values of the columns
of bodies in the units of P,

    y = u' tau,    var y = 1 + 2 s^2 b^2 / weight.

A fit chooses its weight by stretches of time that it holds apart; of poor logs that is decades from what the
next fit will choose, which tells bodies better. It goes with how near they are.

Source: MacKay 1992 (the evidence for a regulariser).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..estimate import Fit
from ..inertia import DIVERGENCES
from ..posed_problem import known_bodies
from ..reduction import triangle

_DECADES, _STEPS = 6, 8  # above the least weight, and steps of each: beyond, data change nothing


def likeliest(fit: Fit, over, variance: float, least: float) -> float:
    """The weight of the prior, from the least on, under which the training logs are likeliest.

    Args:
        over: (joints,) one over each joint's noise. variance: s^2, of what the fit left, in its
            objective's unit.
    """
    size = fit.model.size
    data = fit.compressed if fit.compressed.size == size else fit.compressed.first(size)
    metric = DIVERGENCES[fit.experiment.prior.divergence](fit.prior).hessian(fit.prior)
    sure = known_bodies(fit.experiment, fit.model)
    found, told = seen_of_bodies(data.total(over), fit.prior.ravel(), np.asarray(metric), sure)
    asked = least * np.logspace(0.0, _DECADES, _DECADES * _STEPS + 1)
    return float(asked[np.argmax(log_likelihood(found, told, 0.5 * asked / variance))])


def log_likelihood(found, told, precision) -> np.ndarray:
    """(n,) of what `seen_of_bodies` tells, but for a constant, where the bodies' precision is so many
    (n,) times the metric."""
    spread = 1.0 + found**2 / np.asarray(precision)[:, None]
    return -0.5 * (np.log(spread) + told**2 / spread).sum(axis=1)


def seen_of_bodies(
    whole, prior, metric, known: Sequence[int] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """What a triangle (size + 1, size + 1) tells of bodies once coefficients have taken theirs: singular
    values (k,) of their columns, and what lies in these directions (k,) beyond a prior (10 bodies,).

    Args:
        metric: (bodies, 10, 10), whose units of bodies these are in. known: bodies that are their
            prior.
    """
    count = len(prior)
    beyond = whole[:, -1] - whole[:, :count] @ prior
    taken = whole[:, count:-1]
    taken = taken[:, np.any(taken != 0.0, axis=0)]
    rows = triangle(np.column_stack([taken, whole[:, :count], beyond]))[taken.shape[1] :]
    columns, y = rows[:, -count - 1 : -1], rows[:, -1]
    for b, block in enumerate(metric):
        own = slice(10 * b, 10 * b + 10)
        columns[:, own] = np.linalg.solve(np.linalg.cholesky(block), columns[:, own].T).T
        columns[:, own] *= b not in known
    u, found, _ = np.linalg.svd(columns, full_matrices=False)
    return found, u.T @ y
