"""Bodies that an experiment holds as it states them, and what is said of joints in their place."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from . import pipeline
from .estimate import Fit
from .mean_by_log import MOST
from .noise import NoiseFloor
from .prediction import units
from .unexplained import explains

_ALIKE = 1.02  # times an error: two that differ by less are alike


def told(
    fit: Fit, last: Fit, floors: Sequence[NoiseFloor], named: Collection[str], known: dict
) -> list[str]:
    """Of joints above their floors, or that something is claimed of, whether the bodies that
    `prior.known` holds, let go, leave as little of the test logs as all that is claimed, and half of
    what stands above the noise at most.

    Args:
        fit, last: before and after all claims, which are of the joints `named`. floors: of all.
            known: as of `pipeline.fit_grown`.
    """
    held, errors = fit.experiment.prior.known, fit.rms("test")
    known_floors = [(joint, floor) for joint, floor in zip(fit.joints, floors) if floor.rms]
    pairs = [(j, floor) for j, floor in known_floors if j in named or not floor.reached(errors[j])]
    if not held or not pairs:
        return []
    prior = fit.experiment.prior.model_copy(update={"known": []})
    spec = fit.experiment.model_copy(update={"prior": prior})
    free = pipeline.fit_grown(spec, fit, **known).rms("test")
    then = last.rms("test")
    mended = [
        joint
        for joint, floor in pairs
        if explains(errors[joint], free[joint], floor.rms) >= MOST
        and free[joint] <= _ALIKE * then[joint]
    ]
    if not mended:
        return []
    unit = dict(zip(fit.joints, units(fit.model.robot)))
    words = ", ".join(
        f"{errors[joint]:.4g} to {free[joint]:.4g} {unit[joint]} on {joint}" for joint in mended
    )
    return [
        f"`known` under `prior:` holds {', '.join(held)}: let go, with nothing added, the held-out "
        f"error goes from {words}: a body that is held may not be as it is stated, "
        "and what is said of these joints may stand for it"
    ]
