"""Joints that an experiment locks though its logs hold angles of them that say otherwise."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from . import log, long_log
from .errors import SysidError
from .repeats import TRAVELS
from .robot import Robot
from .specs import Experiment
from .warned import noticed


def elsewhere(experiment: Experiment, robot: Robot) -> Iterator[str]:
    """What is wrong with the lock of each such joint, in words. A link that moves while its model
    stands is in every joint's torque that carries it, and looks like one of their effects.

    Only columns that go by a pattern of the joints' names are found.
    """
    columns = experiment.data.columns.model_copy(update={"velocity": None, "acceleration": None})
    nothing = {"columns": columns, "position": {}, "torque": {}, "signals": {}, "groups": {}}
    for joint, angle in robot.locked.items():
        slides = robot.source.joints[joint].type == "prismatic"
        data = experiment.data.model_copy(update={**nothing, "unused": [joint]})
        how = data, (joint,), np.array([slides]), experiment.folder, {}
        for spec in experiment.data.train:
            try:
                with noticed():
                    spans = long_log.in_spans(spec, *how)
                    q = spans.segments[0].q if spans else log.measured(spec, *how).signals["q"]
            except SysidError:
                continue  # it has no such column
            low, high = q.min(initial=angle), q.max(initial=angle)
            if max(angle - low, high - angle) > TRAVELS:
                unit = "m" if slides else "rad"
                yield (
                    f"joint {joint} is locked at {angle:.3g} {unit}, and {spec.name} has it from "
                    f"{q.min():.3g} to {q.max():.3g}: name it in robot.joints (and in data.unused "
                    "where its torque is not usable), or say in robot.lock where it stands"
                )
                break
