"""Whether the torques of some logs are in another unit than those of the others, which tell it by
what they say of the robot: no mass of the URDF needs to be right, but for which of the two are.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...rows import Rows
from ..as_read import told_by
from ..fault import ERROR, Fault
from ..look import Look, Seen
from .columns import times

# after the angles, whose unit comes first; before the order and the signs of columns
AFTER, SENSELESS = 1.5, ("wrong_unit", "angle_wrap")
_FAR = 20.0  # times: a load makes all torques a few times as large, a thousandth of a unit is more
_LEAVES = 0.25  # of a torque's square: half of it in size
_ALIKE = 2.0  # times: of joints' factors, where it is a unit


def find(look: Look) -> Iterator[Fault]:
    """wrong_unit of logs whose torques, of every joint, are as many times what the others tell."""
    if len(look.logs) < 2 or (seen := look.every) is None:
        return
    low, high = _apart(seen.rows, len(look.logs))
    if not low:
        return
    wrong, right = sorted((low, high), key=lambda logs: -_far_from_urdf(look, seen, logs))
    x, _ = told_by(seen.rows, seen.model, seen.rows.use & np.isin(seen.rows.log, right)[:, None])
    for k in wrong:
        if by := _factor(look, seen.rows, k, right, x):
            name = look.logs[k].path.name
            what = "the other logs tell" if len(right) > 1 else "the other log tells"
            says = f"the torques in {name} are {times(by)} what {what} of the robot"
            do = f"give those in {name} in the unit of the others"
            yield Fault("wrong_unit", ERROR, says, do, log=name)


def _apart(rows: Rows, count: int) -> tuple[list[int], list[int]]:
    """Logs in two parts, at the greatest gap between the sizes of their torques; none in the first
    where that is less than a unit makes."""
    each = np.full((count, rows.tau.shape[1]), np.nan)
    for k in range(count):
        use = rows.use[rows.log == k]
        square = np.sum(rows.tau[rows.log == k] ** 2 * use, axis=0)
        own = square > 0.0
        each[k, own] = 0.5 * np.log(square[own] / use.sum(axis=0)[own])
    told = np.isfinite(each).all(axis=0)
    if not told.any():
        return [], []
    size = each[:, told].mean(axis=1)
    order = np.argsort(size)
    gaps = np.diff(size[order])
    at = int(np.argmax(gaps)) + 1
    if gaps[at - 1] < 0.5 * np.log(_FAR):  # how quickly a robot moves makes some difference
        return [], []
    return order[:at].tolist(), order[at:].tolist()


def _far_from_urdf(look: Look, seen: Seen, logs: Sequence[int]) -> float:
    """The logarithm of the factor by which the torques of logs differ from the URDF's, either way."""
    x = np.zeros(seen.model.size)
    x[: 10 * seen.model.bodies] = look.robot.prior.ravel()
    found = [_scaled(seen.rows, k, x, look.asked(_of(seen.rows, [k]))) for k in logs]
    factors = np.concatenate([factors for factors, _ in found])
    factors = factors[factors > 0.0]
    return abs(float(np.median(np.log(factors)))) if len(factors) else 0.0


def _factor(look: Look, rows: Rows, k: int, right: Sequence[int], x) -> float | None:
    """By how many times the torques of log k are larger than what parameters predict, where every
    joint says as much."""
    asked = sorted({*look.asked(_of(rows, [k]))} & {*look.asked(_of(rows, right))})
    factors, left = _scaled(rows, k, x, asked)
    if not asked or not np.all((left < _LEAVES) & (factors > 0.0)):
        return None
    by = float(np.exp(np.mean(np.log(factors))))
    alike = factors.max() <= _ALIKE * factors.min()
    return by if alike and abs(np.log(by)) > np.log(_FAR) else None


def _of(rows: Rows, logs: Sequence[int]) -> np.ndarray:
    """(n, dof) which rows of logs count."""
    return rows.use & np.isin(rows.log, logs)[:, None]


def _scaled(rows: Rows, k: int, x, asked: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Of joints the factor of what parameters predict of their torque in log k, and what it leaves
    of the torque's square, both about their means."""
    factors, left = np.zeros(len(asked)), np.ones(len(asked))
    for number, j in enumerate(asked):
        own = (rows.log == k) & rows.use[:, j]
        both = np.array([rows.columns[j][own] @ x, rows.tau[own, j]])
        told, tau = both - both.mean(axis=1, keepdims=True)
        factors[number] = told @ tau / max(told @ told, 1e-300)
        left[number] = np.sum((tau - factors[number] * told) ** 2) / max(tau @ tau, 1e-300)
    return factors, left
