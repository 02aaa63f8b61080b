"""The values that a model is not linear in: found by variable projection, before everything else is solved.

For fixed shape values the problem is the convex one of `solve`. Those of a torque effect on a joint are started from
many places (`multistart`); then all values move together by Gauss-Newton steps on what the linear parameters
leave (Golub & Pereyra 1973), damped, within their bounds. At last the profile of the objective over each value is
checked, and where it lies lower than what was found the search goes on from there. The load
that some effects look at is that of the bodies found so far, and is renewed with every step: measured torque in its
place would bring its noise into the columns.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial

import numpy as np

from . import blows, eigen, multistart
from . import rows as row
from .deflection_starts import deflections, from_tries, idle, stands_apart
from .effect import NotFinite
from .estimate import Fit
from .inertia import DIVERGENCES
from .landscape import at_zero
from .model import Model
from .motion import Motion
from .objective import add_blocks
from .prior_weight import number, with_weight
from .projection import inverted
from .settled import Settled, poses
from .shape_search import Block, Search
from .specs import Experiment
from .tangents import tangents
from .triangles import Compressed

_MOST_ROWS, _STEPS, _TRIES, _SETTLED = 6000, 12, 6, 1e-7
_ROUNDING = 1e-14  # share of the greatest
_SHORTER = 0.7  # of a step that failed: what is tried next
_LEAST_SHARE = 0.25  # of the way to another load


def settle(
    experiment: Experiment, model: Model, motion: Motion, prior: np.ndarray, *, weights=None, stride: int | None = None, grid: bool = True,
    hold: bool = False, profile: bool = False, strikes: bool = False, tolerance: float = _SETTLED, found: Collection[Block] = (),
) -> Settled:  # fmt: skip
    """Find a model's shape values and its load on a motion.

    Args:
        weights: (joints,) that multiply the rows of each joint, or None.
        stride: which rows; by default as many as suffice.
        grid: start values that have no start of their own from many places; without it the model's own are where the search begins.
        found: blocks of values that are where a search found them, before the model grew: they start there alone.
        hold: leave the shape values and the load as the model has them.
        profile: check the objective's profile over each value.
        strikes: look all about the values of effects by which a link strikes.
        tolerance: share of the objective by which a step must lower it for another to follow.

    Raises:
        NotFinite: an effect is no finite number wherever it was tried.
    """
    stride = stride or row.stride_for(motion, _MOST_ROWS)
    solved, attempted = _solver(experiment, model, motion, prior, weights, stride)
    # fewer rows say where a profile is worth looking at
    coarse = row.stride_for(motion, multistart.ROWS)
    rough = _solver(experiment, model, motion, prior, weights, coarse)[1] if coarse > stride else attempted
    best = attempted(model) or solved(multistart.finite(model, motion))
    if hold:
        return best
    # of what strikes on the way downhill alone, where that is lower: with other bodies' load it strikes at other times
    if model.uses_load and (model.reference is None or not blows.striking(model)):
        best = solved(best.model.referring_to(best.x))
    search = Search(motion, weights, attempted, lambda found: _descended(found, motion, attempted, weights, tolerance), rough)
    tally = {}
    if grid:
        best, tally = search.started(best, found)
        for place in deflections(best.model):
            tried, count = from_tries(best, motion, *place, weights)
            tally[place] = 1 + count
            if tried is not None:
                best = min(best, solved(tried), key=lambda s: s.objective)
    best = search.descended(best)
    # tried before all else was found, a link may have stayed on its motor; a diagnosis has a fit
    for place in deflections(best.model) if grid and profile else ():
        if place in found and stands_apart(best.model, *place):
            continue  # found so before the model grew: profiles say whether what joined leads elsewhere
        without = idle(best.model, *place)
        tried, count = from_tries(solved(without), motion, *place, weights) if without else (None, 0)
        tally[place] += count
        if tried is not None:
            best = min(best, search.descended(solved(tried)), key=lambda s: s.objective)
    if strikes:
        best, more = blows.searched(best, motion, weights, attempted, search.descended, tolerance)
        tally |= {place: count + tally.get(place, 1) for place, count in more.items()}
    if profile:
        best, searched = search.profiled(best, tally)
        best = replace(best, searched=searched)
    return best


def _solver(experiment: Experiment, model: Model, motion: Motion, prior: np.ndarray, weights, stride: int) -> tuple[Callable, Callable]:
    """What solves for everything linear in a model that grows from this one, on the rows that a stride keeps; and the same, with None
    where an effect is no finite number."""
    lighter = with_weight(experiment, number(experiment) / stride)
    posed = poses(lighter, model, motion, prior, weights, stride)
    last: list[np.ndarray] = []  # where the candidate before was least: the next is not far

    def solved(candidate: Model) -> Settled:
        rows, problem = posed(candidate)
        x = problem.from_nearby(last[0], lighter.solver.tolerance) if last else None
        if x is None:
            x = problem.solve(lighter).x
        last[:] = [x]
        return Settled(candidate, x, problem, rows, stride, problem.objective.value(x))

    def attempted(candidate: Model) -> Settled | None:
        try:
            return solved(candidate)
        except NotFinite:
            return None

    return solved, attempted


def correction(fit: Fit, data: Compressed) -> np.ndarray:
    """(free shape values,) the Gauss-Newton step from where a fit stands, on all of its data.

    Args:
        data: the training data with the slopes of the shape values after the model's own parameters.
    """
    size = fit.model.size
    triangle_ = data.total(fit.weights)
    residual = triangle_[:, :-1] @ np.append(fit.x, np.zeros(data.size - size)) - triangle_[:, -1]
    prior = np.zeros((size, size))
    if fit.experiment.prior.weight:
        divergence = DIVERGENCES[fit.experiment.prior.divergence](fit.prior)
        add_blocks(prior, fit.experiment.prior.weight * np.asarray(divergence.hessian(fit.pi)))
    if fit.known is not None:
        add_blocks(prior, fit.known)
    loose = _loose(fit.model, fit.held, fit.certificate.at_zero)
    columns, slopes = triangle_[:, loose], triangle_[:, size:-1]
    cross = columns.T @ slopes
    system = slopes.T @ slopes - cross.T @ inverted(columns.T @ columns + 0.5 * prior[np.ix_(loose, loose)]) @ cross
    return inverted(system) @ (-slopes.T @ residual)


def _loose(model: Model, held, pinned) -> np.ndarray:
    """Numbers of the linear parameters that answer a step of shape values: all but coefficients that are held, or that their bound
    holds at zero."""
    still = 10 * model.bodies + np.array([*np.flatnonzero(held), *pinned], dtype=int)
    return np.setdiff1d(np.arange(model.size), still)


def _bodies(found: Settled) -> np.ndarray:
    return found.x[: 10 * found.model.bodies].reshape(-1, 10)


def _descended(best: Settled, motion: Motion, solved, weights, tolerance: float) -> Settled:
    """Damped Gauss-Newton over all shape values that are not held.

    Source: Madsen, Nielsen & Tingleff 2004, 3.2 (damping by what a step kept of its promise).
    """
    damping, scale = 1e-3, np.ones(best.model.robot.dof) if weights is None else np.asarray(weights)
    growth = 2.0
    values = best.model.shape_values
    free = [k for k, value in enumerate(values) if not value.held]
    low, high = (np.array([getattr(v, end) for v in values]) for end in ("low", "high"))
    share = 1.0
    for _ in range(_STEPS):
        before = best.objective
        if best.model.uses_load and share >= _LEAST_SHARE:
            best, share = _renewed(best, solved, share)
        moving = _moving(best, motion, free, scale, low, high) if free else None
        if moving is not None and moving[3] > tolerance * abs(best.objective):
            inside, system, right, _ = moving
            at, failed = np.array(best.model.shapes), None
            damped = partial(_damped, system, right, low=low[inside] - at[inside], high=high[inside] - at[inside])
            for _ in range(_TRIES):
                step = damped(damping)
                # nearly what failed would fail again: damping is felt where no bound holds a step back, and only from some size on
                while failed is not None and damping < 1.0 / _ROUNDING and not np.any(np.abs(step) < _SHORTER * np.abs(failed)):
                    damping, growth = min(damping * growth, 1.0 / _ROUNDING), 2.0 * growth
                    step = damped(damping)
                promised = float(right @ step - 0.5 * step @ system @ step)
                moved = at.copy()
                moved[inside] += step
                tried = solved(best.model.with_shapes(np.clip(moved, low, high)))
                if tried is not None and tried.objective < best.objective:
                    kept = (best.objective - tried.objective) / promised if promised > 0 else 1.0
                    best, damping, growth = tried, max(damping * max(1.0 / 3.0, 1.0 - (2.0 * kept - 1.0) ** 3), 1e-9), 2.0
                    break
                failed = step
                damping, growth = min(damping * growth, 1.0 / _ROUNDING), 2.0 * growth
        if not abs(before - best.objective) > tolerance * abs(before):
            break
    return best


def _damped(system, right, damping: float, *, low, high) -> np.ndarray:
    """The step of normal equations with their diagonal enlarged, within bounds."""
    from scipy.optimize import lsq_linear  # its import takes as long as a small fit

    diagonal = np.diagonal(system)
    sizes, axes = eigen.symmetric(system + damping * np.diag(np.where(diagonal > 0, diagonal, 1.0)))
    roots = np.sqrt(np.maximum(sizes, _ROUNDING * max(sizes[-1], _ROUNDING)))
    return lsq_linear(roots[:, None] * axes.T, axes.T @ right / roots, bounds=(low, high), method="bvls").x


def _moving(best: Settled, motion: Motion, free, scale, low, high):
    """The free shape values that no bound holds back, their normal equations, and what a whole step would lower the objective by:
    where that is nothing to speak of, none need be tried."""
    system, right = _normal(best, motion, free, scale)
    at = np.array(best.model.shapes)[free]
    inside = ~((at <= low[free]) & (right <= 0) | (at >= high[free]) & (right >= 0))
    system, right = system[np.ix_(inside, inside)], right[inside]
    return np.array(free)[inside], system, right, 0.5 * float(right @ inverted(system) @ right) if inside.any() else 0.0


def _renewed(best: Settled, solved, share: float) -> tuple[Settled, float]:
    """The model with the load of the bodies found so far, and the share of the way to it that may be gone next time.

    A link that moves by itself answers other bodies' load with blows at other times: there a share that raises the objective
    is not gone, and the next one is half of it.
    """
    new, old = _bodies(best), best.model.reference
    if old is None or not best.model.deflects:
        return solved(best.model.referring_to(best.x)) or best, share
    tried = solved(best.model.with_reference(old + share * (new - old), best.x[new.size :])) or best
    return (tried, min(2.0 * share, 1.0)) if tried.objective <= best.objective else (best, 0.5 * share)


def _normal(found: Settled, motion: Motion, free, scale):
    """Normal equations of the shape values on what the linear parameters leave, those aside that a bound holds."""
    rows = found.rows
    residual = rows.residual(found.x)
    predicted = rows.tau - residual  # where rows count: elsewhere no slope does
    slopes = tangents(found.model, motion, found.x, found.stride, rows.use, predicted)[:, :, free]
    loose = _loose(found.model, found.problem.coordinates.held, at_zero(found))
    objective = found.problem.objective  # of all these columns, weighted
    base = objective.hessian(found.x) if objective.weight else objective.data_hessian()
    cross = sum(2.0 * w**2 * a.T @ t for w, a, t in zip(scale, rows.columns, slopes))
    base, cross = base[np.ix_(loose, loose)], cross[loose]
    system = sum(2.0 * w**2 * t.T @ t for w, t in zip(scale, slopes)) - cross.T @ inverted(base) @ cross
    right = sum(2.0 * w**2 * t.T @ r for w, t, r in zip(scale, slopes, residual.T))
    return system, right
