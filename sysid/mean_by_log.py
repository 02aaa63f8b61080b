"""Joints of which what is left is another mean in each log: a torque's zero that was set anew."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from .estimate import Fit
from .plausible import IN_EACH_LOG, OF_ITS_OWN, Reason, centred, other_means

MOST = 0.5  # of what stands above a floor, or of a square


def by_log(fit: Fit, floors, still: Sequence[str] = ()) -> dict[str, Reason]:
    """{joint: why} of joints of whose error above the NoiseFloor, or above what is noise in any
    case where it is not known, on all logs or on the test logs, most is another mean in each log.

    Args:
        still: joints that stand in the test logs, whose friction may be any there.
    """
    out, about = {}, cache(lambda: centred(fit))
    for joint, (share, square, said) in other_means(fit, fit.logs, still).items():
        floor, error = floors[fit.joints.index(joint)], fit.rms("test")[joint]
        noise, rest = (floor.rms or floor.low or 0.0) ** 2, about().rms("test")[joint]
        misfits = (square / share - noise, square), (error**2 - noise, error**2 - rest**2)
        if any(misfit > 0.0 and taken > MOST * misfit for misfit, taken in misfits):
            # about its mean in each log the error is noise: then nothing else is missing; of what is
            # read in parts nobody knows
            whole = all(
                len(own.t) == len(fit.predictions[part].t)
                for part, own in about().predictions.items()
            )
            left = max(rest, about().rms("train")[joint])
            alone = bool(floor.rms and whole and floor.reached(left))
            out[joint] = Reason(
                f"{'' if alone else 'most of '}{IN_EACH_LOG} ({said}): a torque's zero that was set "
                f"anew, a load, or what hangs on the place; {OF_ITS_OWN}",
                settles=alone,
            )
    return out
