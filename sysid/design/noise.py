"""How quiet a robot's torques are, and how large: what a row of the next log is worth."""

from __future__ import annotations

import numpy as np

from ..estimate import Fit

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
