"""Knocks that no signal shows by itself.

An arm that gives way to a push moves smoothly, and a smooth torque drives it: only what its
equations leave is the push. It stands in those of several joints at once and nowhere else, while
what a model lacks on one joint stays in that joint's equation.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .events import Event
from .listed_effects import build
from .log import Log
from .lowpass import band, lowpassed, stride_of, widest
from .model import Model
from .motion import Motion
from .outliers import BURST, CHANCE, bursts, ratio, surprise
from .projection import inverted
from .robot import Robot
from .rows import Rows, measured, telling
from .running import running
from .specs import EffectSpec
from .stretches import stretches

_EFFECTS = ("viscous", "coulomb", "torque_bias")  # what any joint has
_NEARBY = 0.5  # s to either side whose median a burst must exceed
_OFTEN = 3.0  # s of log to a burst: what comes more often is how the machine moves, and no accident
_FEWEST = 50  # rows of a joint that have a usual
_WHITE = 0.706  # z75 - z50 of a normal variable's size over its median
_PASSES = 2  # the second with every joint weighted by what the first leaves


def bumps(robot: Robot, logs: Sequence[Log], *, among: int = 1) -> list[Event]:
    """Knocks in what rigid bodies with friction, fitted to logs of a robot, leave of them.

    The size of what is left, under the low-pass of a diagnosis, over the usual: the larger of the
    joint's own and of what is about it. A knock is where it surprises on two joints.

    Args:
        among: as of `outliers.spikes`.
    """
    if robot.dof < 2:
        return []
    cutoff = widest(logs, known=(own_band := band(logs)))
    if (motion := lowpassed(logs, robot.joints, cutoff, known=own_band)) is None:
        return []
    model = build(robot, [EffectSpec(name=name) for name in _EFFECTS])
    stride = stride_of(motion, cutoff)
    rows, parts = apart(model, motion, stride)
    step = stride * motion.pieces[0].step
    size = np.abs(_left(rows, parts, _kinds(motion)[rows.piece]))
    own = np.stack([_surprise(a, u, rows.piece, step) for a, u in zip(size.T, rows.use.T)], axis=1)
    span = len(own) * step
    level = np.log(span / BURST * robot.dof * among / CHANCE)
    found = []
    for number, piece in enumerate(motion.pieces):
        (at,) = np.nonzero(rows.piece == number)
        # at once: within a burst, as each joint's rows may count at other moments of it
        wide = running(own[at], max(1, round(BURST / step)), "max")
        for a, b in bursts(np.sort(wide, axis=1)[:, -2], level):
            greatest = own[at[a : b + 1]].max(axis=0)
            joints = tuple(robot.joints[j] for j in np.flatnonzero(greatest > 0.5 * level))
            start, stop = (float(rows.t[at[k]]) for k in (a, b))
            found.append(Event("knock", piece.source, start, stop, joints, "both"))
    return found if len(found) * _OFTEN <= span else []


def apart(model: Model, motion: Motion, stride: int) -> tuple[Rows, list[tuple]]:
    """The rows of a motion without columns, and of each joint the parameters that can enter its
    torque and their columns (support, n), in less memory than all that it has."""
    found = telling(model, motion, measured(motion, stride))
    supports = [model.support(joint) for joint in range(model.robot.dof)]
    columns = [np.zeros((len(support), len(found.tau))) for support in supports]
    for here, parts in stretches(model, motion, stride, keep=False):
        for own, (_, values) in zip(columns, parts):
            own[:, here] = values
    for own, use in zip(columns, found.use.T):
        own *= use
    return found, list(zip(supports, columns))


def _kinds(motion: Motion) -> np.ndarray:
    """(pieces,) number of the levels at which each piece's log is: where these differ, robots may,
    and each has an equation of its own."""
    each = [tuple(sorted(piece.levels.items())) for piece in motion.pieces]
    return np.array([[*dict.fromkeys(each)].index(own) for own in each])


def _left(rows: Rows, joints: list[tuple], kind: np.ndarray) -> np.ndarray:
    """What least squares leave (n, dof), every joint in units of its median; of rows of each kind
    (n,) by itself.

    Args:
        joints: of each, its parameters and their columns (support, n).
    """
    weights, left = np.ones(rows.tau.shape[1]), np.zeros(rows.tau.shape)
    every, parts = slice(None), []
    size = 1 + max(int(at.max(initial=-1)) for at, _ in joints)
    for own in (kind == number for number in np.unique(kind)):
        own = every if own.all() else own
        squares, along = np.zeros((len(joints), size, size)), np.zeros((len(joints), size))
        for j, (at, values) in enumerate(joints):
            values = values[:, own]
            squares[j][np.ix_(at, at)] = values @ values.T
            along[j, at] = values @ rows.tau[own, j]
        parts.append((own, squares, along))
    for _ in range(_PASSES):
        for own, squares, along in parts:
            x = inverted(np.tensordot(weights**2, squares, 1)) @ (weights**2 @ along)
            for j, (at, values) in enumerate(joints):
                left[own, j] = rows.tau[own, j] - x[at] @ values[:, own]
        usual = [np.median(np.abs(e[u])) if u.any() else 0.0 for e, u in zip(left.T, rows.use.T)]
        weights = ratio(np.ones(len(usual)), np.array(usual))
    return left * weights


def _surprise(size, use, piece, step: float) -> np.ndarray:
    """How surprising (n,) sizes are among those that count; less than nothing where none does."""
    out = np.full(len(size), -1.0)
    if use.sum() < _FEWEST:
        return out
    about = np.zeros(len(size))
    for number in np.unique(piece[use]):
        (own,) = np.nonzero(use & (piece == number))
        near = min(2 * round(_NEARBY / step) + 1, len(own))
        about[own] = running(size[own], near, "median", "edge")
    usual = np.median(size[use])
    out[use] = surprise(ratio(size[use], np.maximum(about[use], usual)), _WHITE)
    return out
