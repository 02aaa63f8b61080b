"""What a model's parameters do to the torques of an instant, and how that changes with the motion.

Only effects of the instant take part: what looks back in time has no column that a pose and its
rates alone give. The change is by differences in q, qd and qdd of every joint, all of them in one
pass over stacked copies of the motion.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ..model import Model
from ..motion import Piece

_STEP = 1e-5  # rad, rad/s, rad/s^2 or metres: forward; columns may be differences themselves


def of_the_instant(model: Model) -> Model:
    """The model without effects that look back in time, or at anything but the motion."""
    for effect, joints in model.terms:
        if effect.memory or effect.reach or not effect.instantaneous:
            for joint in joints:
                model = model.without(effect.name, joint)
    return model


def instant_of(model: Model, levels: Mapping[str, str]) -> tuple[Model, np.ndarray]:
    """The model `of_the_instant` of logs at {group: level}, and which parameters of the model its
    own are (size,). Raises SysidError: as `Model.at`."""
    here, kept = model.at(levels, np.arange(model.size))
    instant, place = of_the_instant(here), dict(zip(here.names, kept.tolist()))
    return instant, np.array([place[name] for name in instant.names], dtype=int)


def piece(q, qd, qdd, step: float = 1.0) -> Piece:
    """Samples (n, dof) as effects see them."""
    n, dof = q.shape
    zero = np.zeros((n, dof))
    return Piece(
        log=0, step=step, t=step * np.arange(n), q=q, qd=qd, qdd=qdd, tau=zero, measured=zero,
        signals={}, use=None, smoother=None, core=slice(0, n), rest=np.zeros(dof),
        noise=np.zeros(dof),
    )  # fmt: skip


def columns(model: Model, q, qd, qdd) -> np.ndarray:
    """(dof, size, n) of a model of the instant."""
    n = len(q)
    found = model.columns(piece(q, qd, qdd), slice(0, n))
    out = np.zeros((model.robot.dof, model.size, n))
    for joint, own in enumerate(found):
        out[joint, model.support(joint)] = own
    return out


def with_changes(of: Callable, q, qd, qdd) -> tuple[np.ndarray, np.ndarray]:
    """What a function makes of samples (n, dof), (..., n), and how that changes (..., 3 dof, n) per unit
    of q, then qd, then qdd of each joint.

    Args:
        of: (q, qd, qdd) of any number of samples -> (..., samples).
    """
    n, dof = q.shape
    stacked = np.repeat(np.stack([q, qd, qdd])[:, None], 1 + 3 * dof, axis=1)
    for rate in range(3):
        for joint in range(dof):
            stacked[rate, 1 + rate * dof + joint, :, joint] += _STEP
    whole = of(*stacked.reshape(3, -1, dof))
    whole = whole.reshape(*whole.shape[:-1], 1 + 3 * dof, n)
    here, change = whole[..., 0, :].copy(), whole[..., 1:, :]
    change -= here[..., None, :]
    change /= _STEP
    return here, change
