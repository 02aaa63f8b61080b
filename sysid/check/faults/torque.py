"""What the torques show by themselves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...outliers import quantum
from ...repeats import TRAVELS
from ..fault import ERROR, WARNING, Fault
from ..look import Logged, Look

AFTER, SENSELESS = 0, ()
_COARSE = 0.015  # of the greatest torque


def find(look: Look) -> Iterator[Fault]:
    """effort_missing, coarse_values."""
    for j, joint in enumerate(look.robot.joints):
        for log in look.logs:
            yield from _of_log(look, log, j, joint)


def _of_log(look: Look, log: Logged, j: int, joint: str) -> Iterator[Fault]:
    tally, name = log.tally, log.log.name
    if not tally.swing[j] > 0.0:
        moves = tally.travel[j] > TRAVELS
        if moves or not (tally.low[1].any() or tally.high[1].any()):
            why = "the joint moves" if moves else "so is that of every other joint"
            yield Fault(
                "effort_missing",
                ERROR,
                f"the torque of {joint} is {tally.first[j]:.4g} throughout {name}, and {why}",
                "log its torque or current, or name the joint in data.unused",
                joint,
                name,
                (tally.begin,),
                log.samples,
            )
        return
    tau = log.column("tau", j)
    grain, most = float(quantum(tau)), float(np.quantile(np.abs(tau - np.median(tau)), 0.999))
    if grain > _COARSE * most:
        yield Fault(
            "coarse_values",
            WARNING,
            (
                f"the torque of {joint} comes in steps of {grain:.2g} in {name}, "
                f"{100 * grain / most:.2g} % of its range"
            ),
            "log it with more digits",
            joint,
            name,
            rows=log.samples,
        )
