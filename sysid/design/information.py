"""What a motion tells: the information of its rows, on top of what existing logs tell.

    M = M_0 + P + (samples / nodes) sum_t sum_j c_jt c_jt' / s_j^2

with c the columns of joint j's torque, s its noise, M_0 the information of the logs that exist, and
P the prior as wide as the bodies themselves: of a body nobody knows more than its size. Directions
that no motion can show hold P in all designs alike, so log det M counts the others: what the prior
leaves open.

Source: Fedorov 1972 (D-optimality); Rucker & Wensing 2022 for the metric of P.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..estimate import Fit
from ..inertia import DIVERGENCES
from ..model import Model
from .columns import Slopes, columns


@dataclass(frozen=True)
class Known:
    """What is known before a design.

    model: of the instant, at its shape values; x (size,): parameters; noise (dof,): standard
    deviation of a row's torque [N m], infinite where no row counts; before (size, size): information of the logs that exist and
    the prior. scale (size,): in units of which parameters are well-conditioned.
    """

    model: Model
    x: np.ndarray
    noise: np.ndarray
    before: np.ndarray

    @property
    def dof(self) -> int:
        """Joints."""
        return self.model.robot.dof


_QUIETEST = 1e-9  # N m: of logs without any noise


def noise_of(fit: Fit) -> np.ndarray:
    """(dof,) deviation [N m or N] of a row of each joint's torque: the error on the test logs, or on
    the training logs where no test row counts. Infinite where none does: what such a joint's
    torque would tell, no log will."""
    told = [fit.predictions[part].told() for part in ("test", "train")]
    rms = [test if test is not None else train for test, train in zip(*told)]
    return np.array([np.inf if own is None else max(own, _QUIETEST) for own in rms])


def size_of(fit: Fit) -> np.ndarray:
    """(dof,) RMS [N m or N] of each joint's torque on the training logs; the largest joint's where no
    row counts."""
    train = fit.predictions["train"]
    kept = train.measured if train.use is None else np.where(train.use, train.measured, 0.0)
    rms = np.sqrt((kept**2).sum(axis=0) / np.maximum(train.counts, 1))
    return np.maximum(np.where(rms > 0.0, rms, rms.max()), _QUIETEST)


def own_size(model: Model, prior, x, torque) -> np.ndarray:
    """(size, size) information that bodies are about as the prior, and coefficients about as large
    as would make the joint's torque: nobody expects more.

    Args:
        prior: (bodies, 10). torque: (dof,) size of each joint's torque [N m].
    """
    metric = np.asarray(DIVERGENCES["log-det"](prior).hessian(prior))
    out = np.zeros((model.size, model.size))
    for b, block in enumerate(metric):
        out[10 * b : 10 * b + 10, 10 * b : 10 * b + 10] = block
    count = 10 * model.bodies
    for k, c in enumerate(model.coefficients):
        typical = abs(x[count + k]) or (torque.max() if c.joint < 0 else torque[c.joint])
        out[count + k, count + k] = typical**-2.0
    return out


def gram(known: Known, q, qd, qdd, samples: float) -> np.ndarray:
    """Information (size, size) of nodes (n, dof) that stand for so many samples."""
    found = columns(known.model, q, qd, qdd) / known.noise[:, None, None]
    flat = np.moveaxis(found, 1, 2).reshape(-1, found.shape[1])
    return samples / len(q) * flat.T @ flat


def log_det(information: np.ndarray) -> float:
    """log det of a positive definite matrix, scaled to a unit diagonal first."""
    scale = np.sqrt(np.diagonal(information))
    sign, value = np.linalg.slogdet(information / np.outer(scale, scale))
    return float(value + 2.0 * np.log(scale).sum()) if sign > 0 else -np.inf


def log_det_with_slope(known: Known, slopes: Slopes, weights) -> tuple[float, np.ndarray]:
    """log det M of a motion, and its slope (3 dof, n) in q, qd and qdd of every joint at every
    node.

    Args:
        weights: (n,) how many samples each node stands for.
    """
    root = np.sqrt(weights)
    here = slopes.here / known.noise[:, None, None] * root
    n = here.shape[2]
    flat = np.moveaxis(here, 1, 2).reshape(-1, here.shape[1])
    information = known.before + flat.T @ flat
    scale = 1.0 / np.sqrt(np.diagonal(information))
    inverse = np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale)
    pulled = np.moveaxis((flat @ inverse).reshape(len(here), n, -1), 1, 2)
    pulled = 2.0 * root * pulled / known.noise[:, None, None]
    return log_det(information), np.einsum("jpn,jpvn->vn", pulled, slopes.change)
