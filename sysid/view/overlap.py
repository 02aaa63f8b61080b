"""What a candidate's columns have in common with a torque, with what a model leaves, and with the
motion."""

from __future__ import annotations

import numpy as np

from ..candidate_columns import columns_of
from ..candidates import Candidate
from ..lowpass import calm
from .view import View

_SAME = 0.99  # share of a torque that columns hold


def makes(view: View, candidate: Candidate, shapes: dict[str, float], torque) -> bool:
    """Whether a candidate's columns at shape values make, beside the model's own, nearly all of a
    torque (n, dof) that these do not."""
    columns = columns_of(view.source, candidate, [shapes])[0]
    joints = candidate.touches(view.model.robot.dof)
    target = torque * view.rows.use * view.weights
    base = view.design.columns[joints].reshape(-1, view.design.columns.shape[2])
    flat = (columns * view.weights[joints][:, None, None]).reshape(-1, columns.shape[2])
    wanted = target[:, joints].T.ravel()
    rest = lambda a: wanted - a @ np.linalg.lstsq(a, wanted, rcond=1e-9)[0]  # noqa: E731
    alone = np.sum(rest(base) ** 2)
    both = np.sum(rest(np.concatenate([base, flat], axis=1)) ** 2)
    return bool(alone > 0 and both < (1.0 - _SAME) * alone)


def holds(view: View, general, special) -> bool:
    """Whether one explanation only adds freedom to another: its columns hold the other's torque,
    and it has more numbers.

    Args:
        general, special: a candidate each, its group with its shapes, and the view with it.
    """
    one, other = general.candidate, special.candidate
    if one.nonlinear or one.parameters <= other.parameters or one.joint != other.joint:
        return False
    torque = special.view.source.predicted - view.source.predicted
    return makes(view, one, general.shapes, torque)


def part_taken(view: View, candidate: Candidate, shapes: dict[str, float], coefficients):
    """(dof, n) weighted torque that a candidate with coefficients (k,) takes of the residual, the
    model's own columns refitted."""
    design, joints = view.design, candidate.touches(view.model.robot.dof)
    own = columns_of(view.source, candidate, [shapes])[0] @ coefficients
    out = np.zeros(design.columns.shape[:2])
    out[joints] = own * view.weights[joints, None]
    absorbed = np.einsum("jnk,jn->k", design.columns, out)
    return out - np.einsum("jnk,k->jn", design.columns, absorbed)


def alike(view: View, one, other) -> bool:
    """Whether two candidates may explain the same: on one joint, or wherever they take the same
    part of what a model leaves, the greater half of it at least: then one of them in the model
    leaves the other little to do. What moves a joint changes all torques, and may take something
    else.

    Args:
        one, other: a candidate each, its shapes and its coefficients (k,).
    """
    if one.candidate.joint == other.candidate.joint:
        return True
    both = ((g.candidate, g.shapes, g.coefficients) for g in (one, other))
    first, second = (part_taken(view, *how) for how in both)
    return bool(np.sum(first * second) ** 2 > 0.5 * np.sum(first**2) * np.sum(second**2))


def slow_part(view: View, columns: np.ndarray) -> np.ndarray:
    """Columns (..., n, k) without what is faster than the laws of the motion."""
    last = np.swapaxes(columns, -1, -2)  # samples, as in memory
    values = last.reshape(-1, last.shape[-1]).T
    slow = calm(values, view.rows.piece, view.motion.band, view.step)
    return np.swapaxes(slow.T.reshape(last.shape), -1, -2)
