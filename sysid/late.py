"""How late torque is read: told by what of it is as slow as the motion.

A controller answers the noise of an encoder within a sample, and inertia makes torque of the same
noise. Least squares would turn the one onto the other: of angles of 14 bits at 1 kHz it finds four
fifths of a delay, and less than half of a lag, with deviations of a hundredth of that. So these
values are found where both sides of the equation are under a low-pass at the end of the motion's
own band, in which there is next to none of that noise, and are held there in the fit.

Source: Young 2011 (what noise in a regressor does to the estimate; prefilters).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from . import filters as filtering
from .compress import compress
from .effect import SensorEffect
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
from .warned import noticed


@dataclass(frozen=True)
class Found:
    """A model with its shape values; its slopes there, None where none is free; what was done to
    find them; the prior's weight, None where it had no part in it; and {number: standard deviation}
    of those that another view of the logs told."""

    model: Model
    slopes: Linearised | None
    searched: tuple[Searched, ...]
    strength: PriorWeight | None
    told: dict[int, float]


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
    """`shape_refinement.refined`, what says how late torque is read found on `slow`, a `slow_view`
    of the same logs, where there is one."""
    told = None if slow is None else _told(experiment, structure, slow, prior, near, smaller)
    if told is None:
        return Found(*refined_on(experiment, structure, motion, prior, near, smaller), {})
    elsewhere, how = told
    values = elsewhere.model.shape_values
    at = {
        k: elsewhere.model.shapes[k] for k in late(elsewhere.model) if elsewhere.shape_std[k] > 0.0
    }
    held = {
        (values[k].term, values[k].joint, values[k].shape.name): value for k, value in at.items()
    }
    bound = replace(structure, held=(*structure.held, *held.items()))
    near = None if near is None else near.with_some_shapes(at)
    model, slopes, searched, strength = refined_on(experiment, bound, motion, prior, near, smaller)
    model = replace(model, held=structure.held)
    said = {one.name: one for one in (*how, *searched)}
    order = [said[v.name] for v in model.shape_values if not v.held and v.name in said]
    slopes = Linearised(model, elsewhere.x if slopes is None else slopes.x)
    return Found(
        model, slopes, tuple(order), strength, {k: float(elsewhere.shape_std[k]) for k in at}
    )


def _told(
    experiment: Experiment,
    structure: Model,
    slow: Motion,
    prior,
    near: Model | None,
    smaller: Model | None,
) -> tuple[Fit, tuple[Searched, ...]] | None:
    """The fit of a model to a slow view, and what was done to find its shape values; None where
    that does not tell how late any torque is."""
    try:
        with noticed():
            model, slopes, searched, strength = refined_on(
                experiment, structure, slow, prior, near, smaller
            )
            if slopes is None:
                return None
            weighed = experiment if strength is None else with_weight(experiment, strength.value)
            found = identify(weighed, model, slow, compress(slopes, slow), prior, near=slopes.x)
    except SysidError:
        return None
    return (found, searched) if any(found.shape_std[k] > 0.0 for k in late(model)) else None
