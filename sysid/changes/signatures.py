"""What each change that could be would add to the torque of a held model.

How far a base is tilted is no coefficient: its columns are slopes, about a tilt that is known to be
near, and the residual is taken so that the slopes' coefficients are the whole of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from .. import rows
from ..model import Model
from ..model_parameters import ROBOT
from ..tangents import tangents
from ..vocabulary import find
from .hands import PAYLOAD, held_by

_PER_JOINT = ("coulomb", "viscous", "torque_bias")


TILT = "gravity_tilt", ROBOT


def about(structure: Model, x, motion, stride: int, data, tilt=None, hand=MappingProxyType({})):
    """The residual (n, dof) of a held model, and `signatures`, about a tilt (roll, pitch) [rad].

    Args:
        data: the measured rows. tilt: of the base, None: it stands as the model says. hand: the
            payload's options, by default on the last link.
    """
    here = structure
    if tilt is not None:
        here = structure.with_effect(find(TILT[0]).bound(structure.robot, ROBOT), (ROBOT,))
        here = here.with_shapes([*structure.shapes, *tilt])
    residual = (data.tau - rows.predicted(here, motion, x, stride)) * data.use
    columns = signatures(structure, x, motion, stride, data.use, here, hand)
    if tilt is not None:
        residual += np.einsum("jnk,k->nj", columns[TILT], tilt)
    return residual, {key: own for key, own in columns.items() if np.any(own)}


def signatures(
    structure: Model, x, motion, stride: int, use, tilted: Model, hand: Mapping[str, str]
) -> dict[tuple[str, int], np.ndarray]:
    """Columns (dof, n, k) of every change, by (effect, joint).

    Args:
        tilted: the model with a tilt about which its slopes are, or as it is. hand: the payload's
            options.
    """
    robot, pieces = structure.robot, rows.seen(tilted, motion)
    out = {}
    for joint in range(robot.dof):
        for name in _PER_JOINT:
            columns = np.zeros((robot.dof, len(use), 1))
            columns[joint] = rows.signature(
                tilted, motion, pieces, find(name), joint, {}, stride, use
            )
            out[name, joint] = columns
    load = held_by(hand, robot)
    out[PAYLOAD] = rows.signature(tilted, motion, pieces, load, ROBOT, {}, stride, use)
    if not any(term.name == TILT[0] for term, _ in structure.terms):
        tilting = find(TILT[0]).bound(robot, ROBOT)
        grown = tilted if tilted is not structure else structure.with_effect(tilting, (ROBOT,))
        out[TILT] = tangents(grown, motion, x, stride, use)[:, :, grown.last_shapes]
    return out
