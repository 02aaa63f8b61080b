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
    out = np.zeros(tau.shape, dtype=bool)
    length = max(1, reach // 2)
    if len(tau) < 16 * length:
        return out
    # a spike comes back, a jump does not
    # column by column: the filter of one axis is several times as fast as that of two
    level = np.empty(tau.shape)
    for j, own in enumerate((tau - tau.mean(axis=0)).T):
        level[:, j] = running(own, 2 * SPIKE + 1, "median", "edge")
    total = np.concatenate([np.zeros((1, tau.shape[1])), np.cumsum(level, axis=0)])
    mean = (total[length:] - total[:-length]) / length  # of the rows from k on
    step = mean[length:] - mean[:-length]  # at row k + length
    bent = 0.5 * (step[: -2 * length] + step[2 * length :])
    sizes = np.abs(step[length:-length] - bent)  # at row k + 2 length
    least_said = np.log(sizes.size / CHANCE)
    for j, size in enumerate(sizes.T):
        least = max(np.median(size), quantum(tau[:, j]), NOTHING * np.std(tau[:, j]))
        if least > 0.0:
            top = size > _TOP * running(size, 2 * length + 1, "max")
            found = top & (surprise(size / least, _WHITE) > least_said)
            out[2 * length : 2 * length + len(size), j] = found
    return out
