"""A view whose model grew by an effect, or whose joints count otherwise: everything is settled
again.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..blows import least_of
from ..candidate_columns import columns_of, grown
from ..candidates import Candidate
from ..estimate import Fit
from ..inertia import PARAMETERS
from ..model import Model
from ..posed_problem import inverse
from ..settled import placed
from .design import designed
from .view import View, looked_at

_UNEVEN = 0.35  # logarithm: two joints count half as much against each other, in power
COMPARED = 1e-4  # share of the objective: finer than rivals are ever told apart by
_CHANCE = 1.645  # standard deviations: five per cent to one side


def joined(
    view: View,
    *added: tuple[Candidate, dict[str, float]],
    strikes: bool = False,
    like: View | None = None,
):
    """The view of a view's model with candidates, all settled again from their shape values on.

    Args:
        strikes: as of `looked_at`. like: whose weights and noise it has, where these are not to be
            its own.
    """
    source = view.source
    if any(candidate.effect.uses_load for candidate, _ in added):
        source = replace(source, model=source.referenced)  # while its parameters are the model's
    for candidate, shapes in added:
        source = replace(source, model=grown(source, candidate, shapes))
    how = {"tolerance": COMPARED, "strikes": strikes, "like": like}
    starts = [source.model, *([_next_to_none(source.model)] if strikes else [])]
    found = [_again(view, model, (like or view).weights, **how) for model in starts]
    return min(found, key=lambda one: one.settled.objective)


def as_fitted(view: View, fit: Fit) -> View:
    """A view settled anew from the shape values and the bodies that a fit of its model has, where it
    leaves less: a link that stands apart from its motor, and joined beside bodies that were bent for
    want of it, may be held in a hollow far from where it swings."""
    model, found = view.model, fit.model
    names = ([value.name for value in one.shape_values] for one in (model, found))
    if not model.deflects or next(names) != next(names) or model.size != found.size:
        return view
    own = model.with_shapes(list(found.shapes)).referring_to(fit.x)
    again = _again(view, own, view.weights, tolerance=COMPARED)
    lower = again.settled.objective < (1.0 - COMPARED) * view.settled.objective
    return weighed(again) if lower else view


def _next_to_none(model: Model) -> Model:
    """A model in which what joined last strikes next to nothing: wherever else it begins, a hollow
    may hold it."""
    own = list(enumerate(model.shape_values))[model.last_shapes]
    return model.with_some_shapes({k: least_of(v) for k, v in own if v.shape.start is not None})


def allowed(view: View, candidate: Candidate) -> bool:
    """Whether a candidate that joined does anything at all, with coefficients that may not be
    negative and are not, or one of them is not and the others by no more than chance: of what acts
    by two of which one is nothing, noise makes this one negative every other time. A body's mass may
    not be negative: some logs with a load are all others without."""
    model, first = view.model, 10 * view.model.bodies
    own = [k for k, c in enumerate(model.coefficients) if (c.effect, c.joint) == candidate.key]
    bound = first + np.array([k for k in own if model.coefficients[k].positive], dtype=int)
    below = bound[view.x[bound] <= 0.0]
    if 0 < len(below) and (len(below) == len(bound) or _clearly(view, below)):
        return False
    bodies = [first + k for k in own if model.coefficients[k].of_body]
    if bodies and _clearly(view, np.array(bodies[:: len(PARAMETERS)])):
        return False
    starts = [(v.shape.start, at) for v, at in _own(view, candidate) if v.shape.start is not None]
    return not starts or any(at != start for start, at in starts)


def _clearly(view: View, own: np.ndarray) -> bool:
    """Whether any of these parameters is below nought by more than blocks of time, each left out,
    move it."""
    moves = view.sums.scores @ view.design.turn[own].T
    return bool((view.x[own] < -_CHANCE * np.sqrt(np.sum(moves**2, axis=0))).any())


def weighed(view: View, weights=None) -> View:
    """The view with every joint weighted anew.

    Args:
        weights: (dof,), to compare it by, its noise as known; None: what it now leaves each joint.
    """
    how = {} if weights is None else {"tolerance": COMPARED, "like": view}
    return _again(view, view.model, inverse(view.rms()) if weights is None else weights, **how)


def even(view: View, best: View) -> View:
    """The view with the weights that the best of those that grew from it asks for; itself where
    these are its own.

    A joint that lacks something is loud, counts little, and the prior much: what the prior is in
    the way of would speak for whoever has the most freedom.
    """
    weights = inverse(best.rms())
    uneven = np.ptp(np.log(weights / view.weights)) >= _UNEVEN
    return weighed(view, weights) if uneven else view


def around(view: View, after: View, candidate: Candidate) -> View:
    """A view's model by its slopes about where everything settled with a candidate, `after`: what
    is left there and what the candidate makes there, by its own slopes, is what it leaves, and the
    noise is that view's.

    From where an effect does nothing its slopes say little of what it does where it does much, and
    what it left undone stood in the noise.
    """
    rest, last = after.model.without(*candidate.key), after.settled
    x, values = np.split(last.x, [rest.size])
    how = {"weights": after.weights, "stride": view.stride}
    found = placed(view.experiment, rest, view.motion, view.prior, x, **how)
    known = after.weights, found, view.blocks, (), after
    out = View(view.experiment, view.motion, view.rough, view.prior, view.stride, *known)
    columns = columns_of(out.source, candidate, [shapes_of(after, candidate)])[0]
    if candidate.nonlinear:
        # from where it does nothing; a value that only says how has no torque of its own
        own = _own(after, candidate)
        steps = [0.0 if v.shape.start is None else at - v.shape.start for v, at in own]
        leading = [step for (v, _), step in zip(own, steps) if v.shape.start is not None]
        values = np.array(leading[:1] if candidate.swings else steps)
    left = last.rows.residual(last.x) * after.weights
    joints = candidate.touches(view.model.robot.dof)
    left[:, joints] += (columns @ values).T * after.weights[joints] * last.rows.use[:, joints]
    vars(out)["design"] = designed(found, after.weights, out.source, out.rough_source, left)
    return out


def shapes_of(view: View, candidate: Candidate) -> dict[str, float]:
    """The shape values of a candidate that joined."""
    return {v.shape.name: at for v, at in _own(view, candidate)}


def shapes_in(view: View, candidate: Candidate, shapes: dict[str, float]) -> dict[str, float]:
    """Shape values of a candidate as they stand in a view's model; what it lacks, as in `shapes`."""
    own = shapes_of(view, candidate)
    return {name: own.get(name, at) for name, at in shapes.items()}


def _own(view: View, candidate: Candidate):
    """The shape values of a candidate that joined, and where they stand."""
    model, terms = view.model, view.model.terms
    known = zip(model.shape_values, model.shapes)
    return [(v, at) for v, at in known if (terms[v.term][0].name, v.joint) == candidate.key]


def _again(view: View, model, weights, **how) -> View:
    how |= {"stride": view.stride, "weights": weights, "grid": False, "grown": view}
    return looked_at(view.experiment, model, view.motion, view.rough, view.prior, **how)
