"""Which link holds a load, of a robot that has more than one hand, or foot."""

from __future__ import annotations

import numpy as np

from .. import rows
from ..effect import Effect
from ..model import Model
from ..model_parameters import ROBOT
from ..vocabulary import find
from .halves import question

PAYLOAD = "payload", ROBOT


def hands(robot) -> list[dict]:
    """The options of a payload on each link that may hold one, the last link first."""
    return find(PAYLOAD[0]).places(robot)


def held_by(options: dict, robot) -> Effect:
    """The payload with its options."""
    return find(PAYLOAD[0]).given(**options).bound(robot, ROBOT)


def holding(structure: Model, motion, stride: int, use, residual, weights, blocks) -> dict:
    """The options of the payload that takes most of what a held model leaves: fitted on one half of
    a log and judged on the other.

    Args:
        use: (n, dof) which rows count. residual: (n, dof). weights: (dof,) by which joints count.
        blocks: (n,) the block of each row.
    """
    robot, every = structure.robot, hands(structure.robot)
    if len(every) == 1:
        return every[0]
    pieces = rows.seen(structure, motion)

    def takes(options: dict) -> float:
        one = held_by(options, robot)
        columns = rows.signature(structure, motion, pieces, one, ROBOT, {}, stride, use)
        asked = question({PAYLOAD: columns}, residual, weights, blocks)
        return asked.share(PAYLOAD, asked.across([]), asked.across([PAYLOAD]))

    return every[int(np.argmax([takes(options) for options in every]))]
