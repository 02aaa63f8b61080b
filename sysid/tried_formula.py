"""Whether a formula on a joint is worth typing."""

from __future__ import annotations

from . import comparison, pipeline
from .addition import grown
from .borne_out import NOTHING
from .errors import SysidError
from .estimate import Fit


def falls_with(fit: Fit, joint: str, options: dict) -> bool:
    """Whether the error of a joint on the test logs falls with a formula there, beside what the fit
    has, and no other joint's rises more.

    Args:
        options: of the effect `formula`.
    """
    try:
        spec = grown(fit.experiment, "formula", [joint], options, every=fit.joints)
        after = pipeline.fit_grown(spec, fit, filters=fit.filters)
        change = comparison.of_joint(fit, after, joint)
        falls = -change.delta_rms > NOTHING * fit.rms("test")[joint]
        return falls and not comparison.spoiled(fit, (after,), [joint])
    except SysidError:  # a number that is none, on some of these logs; or logs that changed since
        return False
