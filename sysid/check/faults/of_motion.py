"""Whether what stands for a torque is an angle or a speed of the same log."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...units import ANGLES
from ..equations import FEWEST
from ..fault import ERROR, Fault
from ..look import Look

AFTER, SENSELESS = 0.5, ("joint_order",)
# of its squares, that are left of it: no friction, and no spring, is one unit of torque for each
# unit of speed or angle within three hundredths, and nothing else is in a torque
_LEFT = 1e-3
_WORDS = {"q": "an angle", "qd": "a speed"}


def find(look: Look) -> Iterator[Fault]:
    """joint_order, of torques that are angles or speeds, in whatever unit these may be logged."""
    if look.seen is None:
        return
    rows, joints = look.seen.rows, look.robot.joints
    motion = {word: rows.of(look.seen.motion, name) for name, word in _WORDS.items()}
    for j, joint in enumerate(joints):
        use = rows.use[:, j]
        tau = rows.tau[use, j]
        if use.sum() < FEWEST or not np.ptp(tau) > 0.0:
            continue
        for word, values in motion.items():
            for k, other in enumerate(joints):
                if any(_is(tau, values[use, k] / size) for size in ANGLES.values()):
                    whose = "its own" if k == j else f"that of {other}"
                    yield Fault(
                        "joint_order",
                        ERROR,
                        f"what stands for the torque of {joint} is {word}, {whose}",
                        "name the column of its torque in data.columns.torque, or in data.torque",
                        joint,
                    )
                    break


def _is(tau: np.ndarray, values: np.ndarray) -> bool:
    """Whether some values (n,), but for a constant, are others."""
    mean = tau.mean() - values.mean()
    whole = np.sum((tau - tau.mean()) ** 2)
    return bool(np.sum((tau - values - mean) ** 2) < _LEFT * whole)
