"""How late torque is read: told by what of it is as slow as the motion.

A controller answers the noise of an encoder within a sample, and inertia makes torque of the same
noise. Least squares turns the one onto the other, and finds too short a time: of a planar arm's
5.58 ms, at 1 kHz with angles of 14 bits, 4.49 +- 0.08. So these values are found once more where both
sides of the equation are under a low-pass at the end of the motion's own band, in which there is
next to none of that noise, and are held there in the fit.

Source: Young 2011 (what noise in a regressor does to the estimate; prefilters).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from . import filters as filtering
from .compress import compress
from .effect import NotFinite, SensorEffect
from .errors import SysidError
from .estimate import Fit, identify
from .linearised import Linearised
from .log import Log
from .long_motion import prepare
from .model import Model
from .motion import Motion
from .multistart import Searched
from .prior_weight import PriorWeight, with_weight
from .shape_refinement import refined as refined_on
from .specs import Experiment, PreprocessSpec
from .warned import noticed, warn

_LESS = 2.0  # times less certain; and deviations apart


@dataclass(frozen=True)
class Found:
    """A model with its shape values; its slopes there, None where none is free; what was done to
    find them; the prior's weight, None where it had no part in it; and the numbers of those that
    another view of the logs told, with their covariance."""

    model: Model
    slopes: Linearised | None
    searched: tuple[Searched, ...]
    strength: PriorWeight | None
    told: tuple[tuple[int, ...], np.ndarray] | None = None


def late(model: Model) -> list[int]:
    """Numbers of the free shape values by which torque is read late."""
    values = enumerate(model.shape_values)
    found = [(k, model.terms[v.term][0]) for k, v in values if not v.held]
    return [
        k for k, effect in found if isinstance(effect, SensorEffect) and not effect.constant_gain
    ]


def slow_view(
    experiment: Experiment,
    spec: PreprocessSpec,
    model: Model,
    logs: Sequence[Log],
    prior,
    mapped=None,
) -> Motion | None:
    """Logs under a low-pass at the end of the motion's band; None where a model reads no torque
    late, where the fit has a low-pass on both sides, or none of the angles, and where logs are too
    short for it.

    Args:
        spec: the preprocessing of the fit, its values found. prior: bodies (bodies, 10).
    """
    if not late(model) or spec.filter == "none" or spec.torque == "low-pass":
        return None
    try:
        with noticed():  # of the logs the fit says it
            plain = PreprocessSpec(standstill=spec.standstill, events=spec.events, mask=spec.mask)
            asked = experiment.model_copy(update={"preprocess": plain})
            own = filtering.of_the_motion(asked, model, logs, prior)
            return prepare(logs, filtering.settled(plain, own), model.robot.joints, mapped)
    except SysidError:
        warn(
            "these logs are too short to tell how late torque is read by what is as slow as the "
            "motion: where angles are coarse it may come out too short"
        )
        return None


def refined(
    experiment: Experiment,
    structure: Model,
    motion: Motion,
    slow: Motion | None,
    prior,
    near: Model | None = None,
    smaller: Model | None = None,
) -> Found:
    """`shape_refinement.refined`, what says how late torque is read as `slow` tells it, a
    `slow_view` of the same logs, where there is one.

    All frequencies tell more where angles are fine: what the slow ones tell with much less
    certainty, and not otherwise, is left where it is, with what they differ by in its deviation.

    Source: Hausman 1978 (an efficient estimate against one that is right in any case).
    """
    whole = Found(*refined_on(experiment, structure, motion, prior, near, smaller))
    if slow is None or whole.slopes is None:
        return whole
    try:
        with noticed():
            other = Found(*refined_on(experiment, structure, slow, prior, near, smaller))
            known, told = (
                _fitted(experiment, *own, prior) for own in ((whole, motion), (other, slow))
            )
    except SysidError:
        return whole
    apart = np.abs(np.subtract(other.model.shapes, whole.model.shapes))
    much = told.shape_std > _LESS * known.shape_std
    both = [k for k in late(whole.model) if told.shape_std[k] > 0.0]
    left = [k for k in both if much[k] and apart[k] <= _LESS * told.shape_std[k]]
    kept = [k for k in both if k not in left]
    covariance = np.diag(known.shape_std[left + kept] ** 2 + apart[left + kept] ** 2)
    covariance[len(left) :, len(left) :] = told.shape_covariance[np.ix_(kept, kept)]
    if not kept:
        return replace(whole, told=(tuple(left), covariance))
    values, at = whole.model.shape_values, {k: other.model.shapes[k] for k in kept}
    held = [((values[k].term, values[k].joint, values[k].shape.name), at[k]) for k in kept]
    bound = replace(structure, held=(*structure.held, *held))
    start = whole.model.with_some_shapes(at)
    try:
        model, slopes, _, strength = refined_on(experiment, bound, motion, prior, start)
    except NotFinite:
        return whole
    model = replace(model, held=structure.held)
    slopes = Linearised(model, other.slopes.x if slopes is None else slopes.x)
    searched = tuple(
        other.searched[n] if k in kept else one
        for n, (k, one) in enumerate(zip(whole.slopes.free, whole.searched))
    )
    return Found(model, slopes, searched, strength or whole.strength, ((*left, *kept), covariance))


def _fitted(experiment: Experiment, found: Found, motion: Motion, prior) -> Fit:
    """The fit of a model whose shape values were found, to the rows that told them."""
    if found.strength is not None:
        experiment = with_weight(experiment, found.strength.value)
    data = compress(found.slopes, motion)
    return identify(experiment, found.model, motion, data, prior, near=found.slopes.x)
