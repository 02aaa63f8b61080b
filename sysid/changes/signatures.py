"""What each change that could be would add to the torque of a held model.

How far a base is tilted, or an encoder's zero is off, is no coefficient: its columns are slopes,
about values that are known to be near, and the residual is taken so that the slopes' coefficients
are the whole of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from .. import rows
from ..model import Model
from ..model_parameters import ROBOT, place
from ..tangents import tangents
from ..vocabulary import find
from .halves import Key
from .hands import PAYLOAD, held_by

_PER_JOINT = ("coulomb", "viscous", "torque_bias")
TILT, OFFSET = "gravity_tilt", "encoder_offset"


def bent(structure: Model) -> list[Key]:
    """The changes that are no coefficients, of those that a model lacks: a tilt of the base first,
    as an offset of a first joint may be one."""
    there = {(effect.name, joint) for effect, joints in structure.terms for joint in joints}
    keys = [(TILT, ROBOT), *((OFFSET, joint) for joint in range(structure.robot.dof))]
    return [key for key in keys if key not in there]


def near(structure: Model, changes) -> dict[Key, np.ndarray]:
    """{change: its values} of those changes that are no coefficients: an encoder's zero may be off
    by more than a fit looks for."""
    found = {(change.effect, change.joint): change.parameters for change in changes}
    out = {}
    for name, joint in bent(structure):
        if parameters := found.get((name, where := place(joint, structure.robot.joints))):
            shapes = find(name).shapes()
            out[name, joint] = np.array([parameters[f"{name}.{where}.{o.name}"][0] for o in shapes])
    return out


def about(
    structure: Model, x, motion, stride: int, data,
    at: Mapping[Key, np.ndarray] = MappingProxyType({}), hand=MappingProxyType({}),
):  # fmt: skip
    """The residual (n, dof) of a held model, and `signatures`, about values of what is no
    coefficient.

    Args:
        data: the measured rows. at: as of `near`; what is not in it is as the model says. hand: the
            payload's options, by default on the last link.
    """
    here = structure
    for (name, joint), values in at.items():
        here = _with(here, name, joint, values)
    residual = (data.tau - rows.predicted(here, motion, x, stride)) * data.use
    columns = signatures(structure, x, motion, stride, data.use, here, hand)
    for key, values in at.items():
        residual += np.einsum("jnk,k->nj", columns[key], values)
    return residual, {key: own for key, own in columns.items() if np.any(own)}


def signatures(
    structure: Model, x, motion, stride: int, use, here: Model, hand: Mapping[str, str]
) -> dict[Key, np.ndarray]:
    """Columns (dof, n, k) of every change, by (effect, joint).

    Args:
        here: the model with what its slopes are about, or as it is. hand: the payload's options.
    """
    robot, pieces = structure.robot, rows.seen(here, motion)
    out = {}
    for joint in range(robot.dof):
        for name in _PER_JOINT:
            columns = np.zeros((robot.dof, len(use), 1))
            columns[joint] = rows.signature(
                here, motion, pieces, find(name), joint, {}, stride, use
            )
            out[name, joint] = columns
    keys, grown = bent(structure), here
    for name, joint in (key for key in keys if key in bent(here)):
        grown = _with(grown, name, joint)
    slopes, values = tangents(grown, motion, x, stride, use), grown.shape_values
    of = [(grown.terms[value.term][0].name, value.joint) for value in values]
    its = lambda key: np.array([own == key for own in of], dtype=bool)  # noqa: E731
    out |= {key: slopes[:, :, its(key)] for key in keys}
    # last: of ten numbers, it does what many of the others do
    load = held_by(hand, robot)
    return out | {PAYLOAD: rows.signature(here, motion, pieces, load, ROBOT, {}, stride, use)}


def _with(model: Model, name: str, joint: int, values=None) -> Model:
    """A model with an effect on a joint, at values or where it does nothing."""
    grown = model.with_effect(find(name).bound(model.robot, joint), (joint,))
    return grown if values is None else grown.with_shapes([*model.shapes, *values])
