"""Stretches of logs that the user leaves out, `preprocess.mask`: they count as events do, in no fit
and in no error, with what the filters carry of them to their sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .errors import ConfigError
from .events import Event, ordered
from .log import Log
from .spans import clocks
from .specs import MaskSpec
from .warned import warn


def masked(logs: Sequence[Log], masks: Sequence[MaskSpec], joints: Sequence[str]) -> list[Log]:
    """Logs with the stretches that masks name among their events.

    Args:
        joints: of the robot, in order.

    Raises:
        ConfigError: a mask names a joint that the robot lacks.
    """
    for mask in masks:
        if wrong := [joint for joint in mask.joints or () if joint not in joints]:
            raise ConfigError(
                f"preprocess.mask names the joint {wrong[0]!r}",
                allowed=", ".join(joints),
                do="correct the name, or leave joints out to mask every joint",
            )
    return [_with(log, [m for m in masks if m.log == log.name], joints) for log in logs]


def _with(log: Log, masks: Sequence[MaskSpec], joints: Sequence[str]) -> Log:
    found = []
    for mask in masks:
        own = tuple(joints if mask.joints is None else mask.joints)
        held = [(a, b) for a, b in clocks(log.segments) if a <= mask.stop and b >= mask.start]
        found += [
            Event("mask", log.name, max(mask.start, a), min(mask.stop, b), own) for a, b in held
        ]
        if not held:
            warn(_nothing(log, mask))
    return replace(log, events=ordered([*log.events, *found])) if found else log


def _nothing(log: Log, mask: MaskSpec) -> str:
    first, last = np.ravel(clocks(log.segments))[[0, -1]] if log.segments else (0.0, 0.0)
    return (
        f"preprocess.mask: {log.name} has no row from {mask.start:g} to {mask.stop:g} s; "
        f"its own clock goes from {first:g} to {last:g} s"
    )
