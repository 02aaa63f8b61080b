"""Whether the clocks of logs go on from one to the next: what goes with time since a robot was switched
on shows over one clock alone."""

from __future__ import annotations

import numpy as np

_ROWS = 20_000  # that tell when logs begin
_ANEW = 0.5  # of the shortest log: further apart, clocks go on from one to the next


def clocks_anew(claims) -> list[str]:
    """What to know where friction is another in some logs and the clock of each starts anew: over one
    clock it may be warmth that it goes with."""
    on = [c.head.joint for c in claims if c.head.effect == "friction_change"]
    if not on:
        return []
    parts = [told.thinned(_ROWS) for told in claims[-1].after.predictions.values()]
    clocks = [own.t[own.log == k] for own in parts for k in np.unique(own.log)]
    if np.ptp([own.min() for own in clocks]) > _ANEW * min(np.ptp(own) for own in clocks):
        return []
    return [
        f"friction_change on {', '.join(on)} may be `warmup`, where these logs were taken one after "
        "another: it is asked over one clock, and theirs start anew; write into them the time since "
        "the robot was switched on"
    ]
