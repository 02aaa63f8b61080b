"""What is not known of the load that an effect looks at.

A gear that gives and friction that grows with the load look at the torque that the bodies found need. A fit takes that load for
known. Where its logs tell a rotor's and a link's inertia together and not each, the load is as doubtful as the link, and so is
whatever answers to it: of a soft gear they tell the compliance times the square of the link's inertia.

    d theta = -H^-1 2 A' W^2 dE,      dE what another load changes of the predicted torque, A the slopes of everything fitted,

along the few directions of the bodies' covariance by which each joint's load changes most: to first order, as everything said of a fit's
deviations is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import rows
from .effect import NotFinite
from .estimate import Fit
from .linearised import Linearised
from .model_parameters import ROBOT
from .motion import Motion
from .prior_weight import with_weight
from .projection import inverted, prior_hessian, root
from .settled import placed
from .tangents import tangents

_ROWS, _WHOLE = 3000, 0.99  # rows; how much of what is not known of each load its directions hold
_STEP = 0.1  # of a deviation: of slopes


def with_doubt(fit: Fit, motion: Motion) -> Fit:
    """A fit whose deviations of what answers to the load hold what is not known of the load; itself where nothing does.

    Args:
        motion: the training logs'.
    """
    model = fit.model
    linear = [k for k, c in enumerate(model.coefficients) if model.terms[c.term][0].uses_load and np.isfinite(fit.uncertainty.std[10 * model.bodies + k])]
    bent = [k for k, v in enumerate(model.shape_values) if model.terms[v.term][0].uses_load and np.isfinite(fit.shape_std[k])]
    if not (linear or bent):
        return fit
    try:
        moved = _answers(fit, motion, {*(model.coefficients[k].joint for k in linear), *(model.shape_values[k].joint for k in bent)})
    except NotFinite:  # of a formula, beside where it stands
        return fit
    at = [10 * model.bodies + k for k in linear]
    free = Linearised(model, fit.x).free
    covariance = _with(fit.uncertainty.covariance, at, moved[at])
    shaped = _with(fit.shape_covariance, bent, moved[[model.size + free.index(k) for k in bent]])
    sure = replace(fit.uncertainty, covariance=covariance, std=_std(covariance, fit.uncertainty.std))
    return replace(fit, uncertainty=sure, shape_covariance=shaped, shape_std=_std(shaped, fit.shape_std))


def _answers(fit: Fit, motion: Motion, joints: set[int]) -> np.ndarray:
    """How far each parameter goes (size + free shape values, directions), the load a deviation off in each of some directions."""
    model, x = fit.model, fit.x
    weights = np.ones(model.robot.dof) if fit.weights is None else fit.weights
    stride = rows.stride_for(motion, _ROWS)
    known = placed(with_weight(fit.experiment, fit.strength.value), model, motion, fit.prior, x, weights=fit.weights, stride=stride)
    torque = lambda d: rows.predicted(model.referring_to(x + np.pad(d, (0, len(x) - len(d)))), motion, x, stride)  # noqa: E731
    base, columns, use = torque(np.zeros(len(x))), known.rows.columns, known.rows.use
    bent = tangents(model, motion, x, stride, use)[:, :, Linearised(model, x).free]
    slopes, more = np.concatenate([columns, bent], axis=2) * weights[:, None, None], bent.shape[2]
    moved = [(torque(_STEP * d) - base) * use * weights / _STEP for d in _directions(fit, columns, joints)]
    pull = [2.0 * np.einsum("jnk,nj->k", slopes, own) for own in moved]
    free = np.append(np.isfinite(fit.uncertainty.std), np.ones(more, dtype=bool))
    hessian = 2.0 * np.einsum("jnk,jnl->kl", slopes, slopes) + np.pad(prior_hessian(known), (0, more))
    out = np.zeros((len(free), len(pull)))
    out[free] = -inverted(hessian[np.ix_(free, free)]) @ np.reshape(pull, (len(pull), len(free))).T[free]
    return out


def _directions(fit: Fit, columns: np.ndarray, joints: set[int]) -> np.ndarray:
    """Deviations (directions, size) of the parameters by which the loads of some joints change most: of one after the other, each what
    those before it leave. What is not known of a link's inertia is not known of its rotor's, the other way."""
    robot, count, out = fit.model.robot, 10 * fit.model.bodies, []
    spread = root(np.nan_to_num(fit.uncertainty.covariance))
    left = np.eye(spread.shape[1])
    for j in range(robot.dof) if ROBOT in joints else sorted(joints):
        load = columns[j][:, :count] * np.repeat(robot.carried(j) & ~robot.turned(j), 10) @ spread[:count]
        whole = float(np.sum(load**2))
        _, sizes, turn = np.linalg.svd(load @ left, full_matrices=False)
        known = whole - float(np.sum((load @ left) ** 2))
        many = 0 if known >= _WHOLE * whole else 1 + int(np.searchsorted(known + np.cumsum(sizes**2), _WHOLE * whole))
        out.append(turn[:many] @ spread.T)
        left = left - turn[:many].T @ (turn[:many] @ left)
    return np.concatenate(out)


def _with(covariance: np.ndarray, at: list[int], moved: np.ndarray) -> np.ndarray:
    out = covariance.copy()
    out[np.ix_(at, at)] += moved @ moved.T
    return out


def _std(covariance: np.ndarray, before: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(before), np.sqrt(np.clip(np.nan_to_num(np.diagonal(covariance)), 0.0, None)), before)
