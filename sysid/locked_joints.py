"""Joints that an experiment locks though its logs hold angles of them that say otherwise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import log, long_log
from .errors import SysidError
from .recorded_columns import meant
from .recording import table_of
from .repeats import TRAVELS
from .robot import Robot
from .specs import Experiment
from .warned import noticed

_NAME = "name them in robot.joints (and in data.unused where their torque is not usable)"
_SAY = "say in robot.lock where they stand"
_SHOWN = 4  # joints by name: of a humanoid whose arm is identified thirty may move


@dataclass(frozen=True)
class Off:
    """Where a joint is locked and where a log has it, in words; whether it moves there."""

    says: str
    moves: bool


def elsewhere(experiment: Experiment, robot: Robot, *, named: bool = False) -> dict[str, Off]:
    """{joint: where it is} of such joints. A link that moves while its model stands is in every
    joint's torque that carries it, and looks like one of their effects.

    Args:
        named: of joints that `robot.lock` names, of which somebody has said where they stand, and
            not of the others. Only columns that go by a pattern of the joints' names are found.
    """
    types = {joint: robot.source.joints[joint].type for joint in robot.locked}
    left = [joint for joint in robot.locked if (joint in experiment.robot.lock) is named]
    told: dict[str, Off] = {}
    for spec in experiment.data.train if left else ():
        with noticed():
            found = _angles(experiment, spec, left, types)
        for joint, q in found.items():
            angle, off = robot.locked[joint], q - robot.locked[joint]
            if types[joint] == "continuous":  # a whole turn away is where it stands
                off = (off + np.pi) % (2.0 * np.pi) - np.pi
            if np.abs(off).max(initial=0.0) > TRAVELS:
                left.remove(joint)
                unit = "m" if types[joint] == "prismatic" else "rad"
                words = (
                    f"{joint} at {angle:.3g} {unit}, which {spec.name} has from {q.min():.3g} to"
                )
                told[joint] = Off(f"{words} {q.max():.3g}", bool(np.ptp(q) > TRAVELS))
    return told


def says(told: dict[str, Off]) -> tuple[str, str]:
    """What is said of such joints, and what to do about it."""
    every = [own.says for own in told.values()]
    stand = any(not own.moves for own in told.values())
    shown = [*every[:_SHOWN], *([f"{len(every) - _SHOWN} more"] if len(every) > _SHOWN else [])]
    return (
        f"locked joints that move, or stand elsewhere: {'; '.join(shown)}",
        ", or ".join([_NAME] * any(own.moves for own in told.values()) + [_SAY] * stand),
    )


def _angles(experiment: Experiment, spec, joints: list[str], types: dict) -> dict[str, np.ndarray]:
    """Angles (n,) of those joints of which a log has a column, of the first span of a long one."""
    try:
        table = table_of(spec.names[0], spec, experiment.folder)
        pattern = meant(table, experiment.data.columns, "position")
        if not isinstance(pattern, str) or "{joint}" not in pattern:
            return {}
        there = [joint for joint in joints if table.has(pattern.replace("{joint}", joint))]
        if not there:
            return {}
        columns = experiment.data.columns.model_copy(
            update={"velocity": None, "acceleration": None}
        )
        nothing = {"columns": columns, "position": {}, "torque": {}, "signals": {}, "groups": {}}
        data = experiment.data.model_copy(update={**nothing, "unused": there})
        slides = np.array([types[joint] == "prismatic" for joint in there])
        how = data, tuple(there), slides, experiment.folder, {}
        spans = long_log.in_spans(spec, *how)
        q = spans.segments[0].q if spans else log.measured(spec, *how).signals["q"]
    except SysidError:
        return {}  # a fit says what is wrong with it
    return dict(zip(there, q.T))
