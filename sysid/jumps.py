"""Jumps of a torque: where it steps from one level to another within a few samples.

A drive that starts, stops or reverses a constant acceleration jumps, and so does the acceleration
that it makes. A filter of the angles spreads that over its window; the logged torque it leaves
alone. There the two sides of the equation of motion do not meet, whatever the model.
"""

from __future__ import annotations

import numpy as np

from .outliers import CHANCE, NOTHING, SPIKE, quantum, surprise
from .running import running

_WHITE = 0.70  # z75 - z50 of a Gaussian's absolute values over their median
_TOP = 0.8  # of the largest nearby: a jump stands within a fifth of L of it


def jumps(tau, reach: int) -> np.ndarray:
    """Rows (n, dof) bool at which torque (n, dof) jumps, as seen by a filter that sees `reach` rows
    to either side.

    The step from the mean of L = reach / 2 rows before to that of L rows after, less the mean of
    the steps L rows earlier and later, which a torque that bends smoothly makes as well; out of
    the ordinary among all of its log.
    """
    length = max(1, reach // 2)
    out = np.zeros(tau.shape, dtype=bool)
    if len(tau) < 16 * length:
        return out
    least_said = np.log(tau.shape[1] * (len(tau) - 4 * length + 1) / CHANCE)
    # joint by joint: a long log's torques fill memory, and the filter of one axis is several times
    # as fast as that of two
    for torque, own in zip(tau.T, out.T):
        size = _sizes(torque, length)
        least = max(np.median(size), quantum(torque), NOTHING * np.std(torque))
        if least > 0.0:
            top = size > _TOP * running(size, 2 * length + 1, "max")
            found = top & (surprise(size / least, _WHITE) > least_said)
            own[2 * length : 2 * length + len(size)] = found
    return out


def _sizes(torque: np.ndarray, length: int) -> np.ndarray:
    """Of the steps of a torque (n,) at row 2 length and those after it (n - 4 length + 1,)."""
    # a spike comes back, a jump does not
    level = running(torque - torque.mean(), 2 * SPIKE + 1, "median", "edge")
    total = np.concatenate([[0.0], np.cumsum(level)])
    mean = (total[length:] - total[:-length]) / length  # of the rows from k on
    step = mean[length:] - mean[:-length]  # at row k + length
    bent = 0.5 * (step[: -2 * length] + step[2 * length :])
    return np.abs(step[length:-length] - bent)  # at row k + 2 length
