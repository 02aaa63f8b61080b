"""Whether what stands for a torque has anything to do with its joint's motion."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..equations import LIKELY, Reading
from ..fault import ERROR, Fault
from ..look import Look
from .angles import GEARED, farther

UNTOLD = "log its torque or current, or name the joint in data.unused"
AFTER, SENSELESS = 3, ("wrong_unit", "angle_wrap", "joint_order", "sign_flipped")
_FOLLOWS = 0.5  # of its square: a torque the greater half of which is friction and masses is one


def find(look: Look) -> Iterator[Fault]:
    """effort_missing, of a signal that is no torque.

    It varies less than the lightest plausible bodies alone need, and not as any bodies, motor and
    friction do: a channel that nothing was connected to, or another sensor's.
    """
    if look.equations is None:
        return
    scored = look.equations.scored(Reading.plain(look.robot.dof), free=True)
    follows = 1.0 - scored.left / scored.whole
    needs = LIKELY[0] * np.sqrt(scored.bodies)
    for j, joint in enumerate(look.robot.joints):
        silent = follows[j] < _FOLLOWS and needs[j] > np.sqrt(scored.whole[j])
        if silent and scored.known[j] and look.excited[j].enough:
            times = needs[j] / np.sqrt(scored.whole[j])
            yield Fault(
                "effort_missing",
                ERROR,
                (
                    f"what stands for the torque of {joint} does not follow its motion: bodies of a "
                    f"third of the URDF's masses need {times:.2g} times what it varies by, and "
                    f"{100 * max(follows[j], 0.0):.0f} % of that is as bodies, motor and friction "
                    "make it"
                ),
                f"{UNTOLD}; {GEARED}" if farther(look, j) else UNTOLD,
                joint,
            )
