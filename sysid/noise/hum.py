"""A steady tone in a joint's noise, in words: a machine nearby, the mains, a drive's own hum.

It is noise, as no function of the motion makes it; but a low-pass on both sides takes it out where
it is faster than the motion, and white noise stays.
"""

from __future__ import annotations

import numpy as np

from ..flexible import TONE, steady

_MUCH = 0.1  # of the noise's power: less changes no error by more than a twentieth


def hum(values: list[np.ndarray], steps: list[float]) -> str:
    """What is said of it: empty where there is none, or little.

    Args:
        values: (n,) of each run, what is left of a residual; the longest tells. steps: [s] of each.
    """
    longest = max(range(len(values)), key=lambda k: len(values[k]))
    share, chance, hertz = steady(values[longest], np.zeros(len(values[longest])), steps[longest])
    if chance >= TONE or share < _MUCH:
        return ""
    return f", {100 * share:.0f} % of the noise's power a steady tone of {hertz:.3g} Hz"
