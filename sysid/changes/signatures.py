"""What each change that could be would add to the torque of a held model."""

from __future__ import annotations

import numpy as np

from .. import rows
from ..effect import MotionEffect
from ..model import Model
from ..model_parameters import ROBOT
from ..tangents import tangents
from ..vocabulary import find

_PER_JOINT = ("coulomb", "viscous", "torque_bias")


def signatures(structure: Model, x, motion, stride: int, use) -> dict[tuple[str, int], np.ndarray]:
    """Columns (dof, n, k) of every change, by (effect, joint)."""
    robot, pieces = structure.robot, rows.seen(structure, motion)
    out = {}
    for joint in range(robot.dof):
        for name in _PER_JOINT:
            columns = np.zeros((robot.dof, len(use), 1))
            columns[joint] = rows.signature(
                structure, motion, pieces, find(name), joint, {}, stride, use
            )
            out[name, joint] = columns
    for name in ("payload", "gravity_tilt"):
        effect = find(name).bound(robot, ROBOT)
        if isinstance(effect, MotionEffect):
            if any(term.name == name for term, _ in structure.terms):
                continue
            grown = structure.with_effect(effect, (ROBOT,))
            out[name, ROBOT] = tangents(grown, motion, x, stride, use)[:, :, grown.last_shapes]
        else:
            out[name, ROBOT] = rows.signature(
                structure, motion, pieces, effect, ROBOT, {}, stride, use
            )
    return out
