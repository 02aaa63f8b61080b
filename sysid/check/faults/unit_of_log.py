"""Whether the torques of one log are in another unit than those of the others, which tell it by what
they say of the robot, so that no mass of the URDF needs to be right.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..as_read import told_by
from ..equations import FEWEST, LIKELY
from ..fault import ERROR, Fault
from ..look import Look
from .columns import times

AFTER, SENSELESS = 1, ("wrong_unit", "angle_wrap")
_LEAVES = 0.25  # of a torque's square, as of another reading of one log's columns
_MOST = 0.5  # of the joints
_ALIKE = 2.0  # times: of joints' factors, where it is a unit


def find(look: Look) -> Iterator[Fault]:
    """wrong_unit of logs whose torques, of every joint, are as many times what the others tell."""
    if len(look.logs) < 2 or (seen := look.every) is None:
        return
    rows, count = seen.rows, range(len(look.logs))
    train = [k for k in count if look.logs[k].part == "train"]
    asked = asked_of(look, rows.use)
    size = np.array([_sizes(rows, rows.log == k) for k in count])[:, asked]
    usual = np.exp(np.median(np.log(size[train]), axis=0))
    away = np.abs(np.log(size / usual)) > np.log(LIKELY[1])  # motion may make a joint or two so
    odd = [k for k in count if len(asked) and np.mean(away[k]) > _MOST]
    rest = rows.use & ~np.isin(rows.log, odd)[:, None]
    if not odd or not set(asked) <= set(asked_of(look, rest)):
        return
    x, _ = told_by(rows, seen.model, rest)
    for k in odd:
        factors, left = _scaled(rows, rows.log == k, x, asked)
        tells = (left < _LEAVES) & (factors > 0.0)  # a joint that stands in it tells nothing
        if not np.mean(tells) > _MOST:
            continue
        factors = factors[tells]
        by = float(np.exp(np.mean(np.log(factors))))
        if LIKELY[0] < by < LIKELY[1] or factors.max() > _ALIKE * factors.min():
            continue
        name = look.logs[k].path.name
        says = f"the torques in {name} are {times(by)} what the other logs tell of the robot"
        yield Fault("wrong_unit", ERROR, says, "give that file's in the same unit", log=name)


def asked_of(look: Look, use) -> list[int]:
    """The joints that move enough and of which enough rows (n, dof) are used."""
    return [j for j in range(look.robot.dof) if look.excited[j].enough and use[:, j].sum() > FEWEST]


def _sizes(rows, own) -> np.ndarray:
    """(dof,) RMS torque of some rows that count; one where none does."""
    use = rows.use[own]
    square = np.sum(rows.tau[own] ** 2 * use, axis=0) / np.maximum(use.sum(axis=0), 1)
    return np.sqrt(np.where(square > 0.0, square, 1.0))


def _scaled(rows, own, x, asked) -> tuple[np.ndarray, np.ndarray]:
    """Of joints the factor of what parameters predict of their torque in some rows, and what it leaves
    of the torque's square, both about their means."""
    factors, left = [], []
    for j in asked:
        use = rows.use[own, j]
        both = np.array([rows.columns[j][own] @ x, rows.tau[own, j]])[:, use]
        told, tau = both - both.mean(axis=1, keepdims=True)
        factor = told @ tau / max(told @ told, 1e-300)
        factors.append(factor)
        left.append(np.sum((tau - factor * told) ** 2) / max(tau @ tau, 1e-300))
    return np.array(factors), np.array(left)
