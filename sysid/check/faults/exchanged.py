"""Whether angles and torques changed places: in a log whose header, or whose columns, are the wrong
way round.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...full_turns import TURN
from ..fault import ERROR, Fault
from ..look import Logged, Look

AFTER, SENSELESS = 0, ()
_SMOOTHER = 0.5  # times as rough: bodies smooth what drives them by two integrations
_FREE = 2.0 * TURN  # rad: where a joint has no limits


def find(look: Look) -> Iterator[Fault]:
    """joint_order, of angles and torques."""
    found = [log for log in look.logs if _exchanged(look, log)]
    every = len(found) == len(look.logs)
    do = (
        "exchange data.columns.position and data.columns.torque"
        if every
        else "correct that file's columns, or leave the file out"
    )
    for log in found:
        yield Fault(
            "joint_order",
            ERROR,
            f"angles and torques look exchanged in {log.log.name}{', as in every log' if every else ''}: "
            "what stands for angles is rough and leaves the joints' limits, what stands for torques "
            "is smooth and within them",
            do,
            "",
            log.path.name,
        )


def _exchanged(look: Look, log: Logged) -> bool:
    """Whether angles leave what joints can do, torques do not, and every torque is the smoother."""
    if not any(own.far.count or own.beyond.count or own.fast.count for own in log.tally.joints):
        return False
    for j, (low, high) in enumerate(look.robot.limits):
        if not log.tally.swing[j] > 0.0:
            continue  # of a torque that never changes nobody knows
        q, tau = log.column("q", j), log.column("tau", j)
        free = np.inf if look.robot.prismatic[j] else _FREE
        least, most = max(low, -free), min(high, free)
        if tau.min() < least or tau.max() > most or not _rough(tau) < _SMOOTHER * _rough(q):
            return False
    return True


def _rough(values: np.ndarray) -> float:
    """Changes of changes over changes, root mean square; infinite of a constant, and of two."""
    change = np.diff(values)
    size = float(np.mean(change**2)) if len(change) > 1 else 0.0
    return float(np.sqrt(np.mean(np.diff(change) ** 2) / size)) if size > 0.0 else np.inf
