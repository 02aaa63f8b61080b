"""Noise of the angles that is larger in some rows than in others: what spectra miss."""

import math
from dataclasses import replace

import numpy as np

from .spectrum import Weighed

_HALF = 0.5  # what so few rows say of it


def with_uneven(found: Weighed, drawn, counts, times: float, seen: float) -> Weighed:
    """With what the angles' noise makes where a spectrum hardly looks: at the ends of a log, which
    its window weighs least and a clock is least known at, and in rows that are left out.

    Args:
        drawn: (draws, n) what the angles' noise, drawn again, makes of each run [N m or N]. counts:
            (n,) rows of each that count. times: the share of its power that is in the residual.
            seen: the power that the spectrum has of it [(N m)^2].
    """
    inside = np.concatenate([v[:, own] for v, own in zip(drawn, counts)], axis=1)
    missed = times * (float(np.mean(inside**2)) - seen)
    if not missed > 0.0:
        return found
    rms, std = math.sqrt(found.rms**2 + missed), 2.0 * found.rms * found.std
    most = std < (own := _HALF * missed)
    doubt = "errors of stamps or angles are large in a few places" if most else found.doubt
    return replace(found, rms=rms, std=math.hypot(std, own) / (2.0 * rms), doubt=doubt)
