"""Shape values found on rows that fit in memory, refined on all rows, with the weight of the prior under them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import shape
from .blows import scatter, striking
from .compress import compress
from .drives import rescaled
from .effect import NotFinite
from .estimate import Fit, identify
from .held_apart import prior_strength
from .linearised import Linearised
from .model import Model
from .motion import Motion
from .multistart import Searched, finite
from .prior_weight import PriorWeight, is_auto, with_weight
from .specs import Experiment

_PASSES, _NEAR = 3, 0.1  # refinements on all rows; of a standard deviation, or of a value's range
_PART = 0.25  # of a step that led uphill
_ROUNDS = 3  # of a prior's weight and the shape values under it


def refined(experiment: Experiment, structure: Model, motion: Motion, prior, near: Model | None = None, smaller: Model | None = None) -> tuple[Model, Linearised | None, tuple[Searched, ...], PriorWeight | None]:
    """The model measured by a motion, its shape values found: on rows that fit in memory, then by Gauss-Newton steps on all
    of them. Its slopes there, None where no shape value is free, and what was done to find them. And the prior's weight, None
    where it had no part in it.

    Args:
        near: the model with shape values that are not far from the best, where that is known.
        smaller: one that it grew from, whose shape values were found: they are where these are looked for, and profiles say whether
            what came with them leads elsewhere.
    """
    structure = finite(structure.measured_by(motion), motion)
    if not (structure.shape_values or structure.uses_load):
        return structure, None, (), None
    strength = None
    if is_auto(experiment):
        begun = Linearised(structure, np.append(prior.ravel(), np.zeros(len(structure.coefficients))))
        strength = prior_strength(experiment, structure, motion, compress(begun if structure.gains else structure, motion), prior)
    weighed = experiment if strength is None else with_weight(experiment, strength.value)
    if near is None:
        start, known = _begun(structure, smaller)
        found = shape.settle(weighed, start, motion, prior, profile=True, strikes=True, found=known)
    else:  # the search has been made
        found = shape.settle(weighed, structure.with_shapes(near.shapes), motion, prior, grid=False, strikes=True)
    bodies, searched = found.x[: 10 * structure.bodies].reshape(-1, 10), found.searched
    if (scaled := rescaled(found.model, weighed, bodies, prior)) is not found.model:
        found = shape.settle(weighed, scaled, motion, prior, grid=False)
    structure, slopes = found.model, Linearised(found.model, found.x)
    if not slopes.free:
        return structure, None, searched, None
    best = None
    for number in range(_PASSES):
        try:
            data = compress(slopes, motion)
        except NotFinite:
            if best is None:
                raise
            return best[1], best[2], searched, best[3]  # of a formula, the last step left its domain
        for _ in range(_ROUNDS if number == 0 else 0):  # what was missing before is in the model now
            before, strength = strength, prior_strength(experiment, structure, motion, data, prior, strength)
            weighed = with_weight(experiment, strength.value)
            if before is None or before.value == strength.value:
                break
            again = shape.settle(weighed, structure, motion, prior, grid=False, profile=True)
            searched = tuple(one.checked_again(other) for one, other in zip(searched, again.searched))
            structure, slopes = again.model, Linearised(again.model, again.x)
            data = compress(slopes, motion)
        fit = identify(weighed, structure, motion, data, prior, near=slopes.x)
        # blows make valleys narrower than a step, and slopes say little at a corner, or where others do nearly the same: part of
        # the last step is tried, else it is taken back; not the load that was renewed with it, which may cost more than the one before
        if best is not None and fit.objective > best[0]:
            if number < _PASSES - 1:
                begun = np.array(best[1].shapes)
                structure = structure.with_shapes(begun + _PART * (np.array(structure.shapes) - begun))
                slopes = Linearised(structure, best[2].x)
                continue
            if structure.uses_load and not structure.deflects:
                structure = structure.with_shapes(best[1].shapes)
                return structure, Linearised(structure, best[2].x), searched, best[3]
            return best[1], best[2], searched, best[3]
        best = fit.objective, structure, slopes, strength
        change = shape.correction(fit, data)
        values = np.array(structure.shapes)
        low, high = (np.array([getattr(v, end) for v in structure.shape_values]) for end in ("low", "high"))
        values[slopes.free] += change
        values = np.clip(values, low, high)
        # of what slopes hardly tell no deviation is near: such a step is looked at as well
        moved = np.abs(values - structure.shapes)[slopes.free]
        far = np.any(moved > _NEAR * np.fmin(fit.shape_std, high - low)[slopes.free])
        if far and number == _PASSES - 1:
            break  # nobody would look where it leads
        structure = structure.with_shapes(values)
        if structure.uses_load:
            structure = structure.referring_to(fit.x)
        slopes = Linearised(structure, fit.x)
        if not far:
            break
    return structure, slopes, searched, strength


def _begun(structure: Model, smaller: Model | None) -> tuple[Model, set[tuple[int, int]]]:
    """A model with the shape values that were found of one that it grew from, and the blocks (term, joint) that have all of theirs
    there: of effects that are the same, and not where the user has another start or other bounds by now."""
    known = {} if smaller is None else {(v.name, _same(smaller, v)): at for v, at in zip(smaller.shape_values, smaller.shapes) if not v.held}
    free = {k: v for k, v in enumerate(structure.shape_values) if not v.held}
    found = {k: known.get((v.name, _same(structure, v))) for k, v in free.items() if v.begin is None}
    at = {k: value for k, value in found.items() if value is not None and free[k].low <= value <= free[k].high}
    new = {(v.term, v.joint) for k, v in free.items() if k not in at}
    return structure.with_some_shapes(at), {(v.term, v.joint) for v in free.values()} - new


def _same(model: Model, value) -> tuple:
    """What an effect with a shape value is, but for its joint and its values."""
    effect = model.terms[value.term][0]
    return type(effect).__name__, effect.equation, tuple(str(getattr(effect, name, None)) for name in effect.options)


def scattered(fit: Fit, motion: Motion) -> Fit:
    """A fit that says of what strikes how far it scatters: slopes there say how far the next hollow is."""
    if not striking(fit.model):
        return fit
    found = shape.settle(fit.experiment, fit.model, motion, fit.prior, weights=fit.weights, hold=True)
    std, covariance = fit.shape_std.copy(), fit.shape_covariance.copy()
    for k, spread in scatter(found, motion, fit.weights).items():
        if np.isfinite(std[k]) and spread > std[k]:
            covariance[k] *= spread / std[k]
            covariance[:, k] *= spread / std[k]
            std[k] = spread
    return replace(fit, shape_std=std, shape_covariance=covariance)
