"""The values that a model is not linear in: found by variable projection, before everything else is solved.

For fixed shape values the problem is the convex one of `solve`. Those of a torque effect on a joint are started from
many places (`multistart`); then all values move together by Gauss-Newton steps on what the linear parameters
leave (Golub & Pereyra 1973), damped, within their bounds. At last the profile of the objective over each value is
checked, and where it lies lower than what was found the search goes on from there. The load
that some effects look at is that of the bodies found so far, and is renewed with every step: measured torque in its
place would bring its noise into the columns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from . import multistart
from . import rows as row
from .compress import Compressed, Factor, triangle
from .effect import Deflection, NotFinite, TorqueEffect
from .estimate import Fit, Problem, pose
from .inertia import DIVERGENCES
from .landscape import at_zero, landscape
from .model import Model, moving_coefficients
from .motion import Motion
from .multistart import Searched
from .objective import add_blocks
from .prior_weight import number, with_weight
from .projection import Projection, inverted, prior_hessian
from .specs import Experiment

_MOST_ROWS, _STEPS, _SETTLED = 6000, 12, 1e-7
_LEAST_SHARE = 0.25  # of the way to another load
_SOLVED = 3  # of the best places, which are solved with every bound kept
_ROUNDS, _LOWER, _POINTS = 4, 1e-8, 8  # of profiles; a share of the objective that is lower; values where each is a fit of its own


@dataclass(frozen=True)
class Settled:
    """A model with its shape values found, the linear parameters x there, and the rows that both were found on.

    searched: what was done about the shape values, where they were searched.
    """

    model: Model
    x: np.ndarray
    problem: Problem
    rows: row.Rows
    stride: int
    objective: float
    searched: tuple[Searched, ...] = ()


def condensed(model: Model, rows: row.Rows) -> Compressed:
    """Rows as triangles, one a joint."""
    factors = []
    for joint in range(model.robot.dof):
        support = model.support(joint)
        kept = rows.use[:, joint]
        stacked = np.concatenate([rows.columns[joint][kept][:, support], rows.tau[kept, joint, None]], axis=1)
        factors.append(Factor(joint, 0, support, triangle(stacked), int(kept.sum())))
    return Compressed(model.size, model.robot.dof, tuple(factors), len(rows.t))


def settle(
    experiment: Experiment, model: Model, motion: Motion, prior: np.ndarray, *, weights=None, stride: int | None = None, grid: bool = True,
    hold: bool = False, profile: bool = False, tolerance: float = _SETTLED,
) -> Settled:  # fmt: skip
    """Find a model's shape values and its load on a motion.

    Args:
        weights: (joints,) that multiply the rows of each joint, or None.
        stride: which rows; by default as many as suffice.
        grid: start values that have no start of their own from many places; without it the model's own are where the search begins.
        hold: leave the shape values and the load as the model has them.
        profile: check the objective's profile over each value.
        tolerance: share of the objective by which a step must lower it for another to follow.

    Raises:
        NotFinite: an effect is no finite number wherever it was tried.
    """
    stride = stride or row.stride_for(motion, _MOST_ROWS)
    lighter = with_weight(experiment, number(experiment) / stride)
    moving = moving_coefficients(model, motion)

    def solved(candidate: Model) -> Settled:
        rows = row.stack(candidate, motion, stride)
        problem = pose(lighter, candidate, condensed(candidate, rows), moving, prior, weights)
        solution = problem.solve(lighter)
        return Settled(candidate, solution.x, problem, rows, stride, solution.objective)

    def attempted(candidate: Model) -> Settled | None:
        try:
            return solved(candidate)
        except NotFinite:
            return None

    best = attempted(model) or solved(multistart.finite(model, motion))
    if hold:
        return best
    if model.uses_load:
        best = solved(best.model.with_reference(_bodies(best)))
    tally = {}
    if grid:
        for block in _blocks(best.model, motion):
            best, tally[block] = _started(best, motion, block, weights, attempted)
        for term, (effect, joints) in enumerate(best.model.terms):
            for joint in joints if isinstance(effect, Deflection) else ():
                if (tried := _from_tries(best, motion, term, joint, weights)) is not None:
                    best = min(best, solved(tried), key=lambda s: s.objective)
    best = _descended(best, motion, attempted, weights, tolerance)
    if profile:
        best = _profiled(best, motion, weights, attempted, tally, tolerance)
    return best


def _blocks(model: Model, motion: Motion) -> list[tuple[int, int]]:
    """(term, joint) of torque effects with free shape values, on joints that move: what is searched together."""
    moves = [joint not in (*motion.still, *motion.unused) for joint in model.robot.joints]
    blocks = [
        (v.term, v.joint) for v in model.shape_values
        if isinstance(model.terms[v.term][0], TorqueEffect) and model.terms[v.term][0].coefficients() and moves[v.joint] and not v.held
    ]  # fmt: skip
    return list(dict.fromkeys(blocks))


def _own(model: Model, block: tuple[int, int]) -> list[int]:
    """Which of a model's shape values are a block's, and free."""
    return [k for k, v in enumerate(model.shape_values) if (v.term, v.joint) == block and not v.held]


def _tried(model: Model, own: list[int]) -> list[np.ndarray]:
    values = [model.shape_values[k] for k in own]
    angle = None if model.scales is None else float(model.scales.angle[values[0].joint])
    return [np.asarray(v.shape.values(v.low, v.high, angle), dtype=float) for v in values]


def _placed(model: Model, own: list[int], values) -> Model:
    at = dict(zip(own, map(float, values)))
    return model.with_shapes([at.get(k, s) for k, s in enumerate(model.shapes)])


def _started(best: Settled, motion: Motion, block, weights, attempted) -> tuple[Settled, int]:
    """A block of shape values started from many places: the best of them, and how many there were."""
    own, count = _own(best.model, block), 0
    wanted = [best.model.shape_values[k].begin for k in own]
    for pinned in (False, True):  # first as if no coefficient had a bound, then with those that came to it
        if pinned and not at_zero(best):
            break
        fine = landscape(best, motion, *block, weights, pinned=pinned)
        rough = landscape(best, motion, *block, weights, pinned=pinned, rows=multistart.ROWS)
        begin = [fine.here, [here if at is None else at for here, at in zip(fine.here, wanted)]]
        found, sets = multistart.places(rough, fine, _tried(best.model, own), begin)
        count += sets
        for place in found[:_SOLVED]:
            solution = attempted(_placed(best.model, own, place.values))
            best = solution if solution is not None and solution.objective < best.objective else best
    return best, count


def _profiled(best: Settled, motion: Motion, weights, attempted, tally: dict, tolerance: float) -> Settled:
    """The model after the profile over each shape value was checked, and gone on from where it is lower."""
    lower, points = set(), {}
    for _ in range(_ROUNDS):
        before = best
        for block in _blocks(best.model, motion):
            own = _own(best.model, block)
            for pinned in (True, False) if at_zero(best) else (True,):
                fine = landscape(best, motion, *block, weights, pinned=pinned)
                place, counts = multistart.lower_on_profile(fine, _tried(best.model, own), _LOWER)
                points |= dict(zip(own, counts))
                found = None if place is None else attempted(_placed(best.model, own, place.values))
                further = _gone_on(best, found, motion, weights, attempted, tolerance)
                lower |= set(own) if further is not best else set()
                best = further
        for k, value in enumerate(best.model.shape_values):
            if k in points and (value.term, value.joint) in tally or value.held or (value.term, value.joint) in _blocks(best.model, motion):
                continue
            tried = [attempted(_placed(best.model, [k], [at])) for at in np.linspace(value.low, value.high, _POINTS)]
            points[k] = _POINTS
            found = min((one for one in tried if one is not None), key=lambda s: s.objective, default=None)
            further = _gone_on(best, found, motion, weights, attempted, tolerance)
            lower |= {k} if further is not best else set()
            best = further
        if best is before:
            break
    done = tuple(
        Searched(v.name, tally.get((v.term, v.joint), 1), points.get(k, 0), k in lower)
        for k, v in enumerate(best.model.shape_values) if not v.held
    )  # fmt: skip
    return replace(best, searched=done)


def _gone_on(best: Settled, found: Settled | None, motion: Motion, weights, attempted, tolerance: float) -> Settled:
    """The better of two, the search gone on from the other where it is lower."""
    if found is None or not found.objective < best.objective * (1.0 - _LOWER):
        return best
    return _descended(found, motion, attempted, weights, tolerance)


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
    columns, slopes = triangle_[:, :size], triangle_[:, size:-1]
    cross = columns.T @ slopes
    system = slopes.T @ slopes - cross.T @ inverted(columns.T @ columns + 0.5 * prior) @ cross
    return inverted(system) @ (-slopes.T @ residual)


def _bodies(found: Settled) -> np.ndarray:
    return found.x[: 10 * found.model.bodies].reshape(-1, 10)


def _from_tries(found: Settled, motion: Motion, term: int, joint: int, weights) -> Model | None:
    """The model with the best of the values that a deflection says to try, where it does nothing yet and none is held: on the
    other side of a resonance no step from there arrives."""
    model, rows = found.model, found.rows
    effect = model.terms[term][0]
    own = {v.shape.name: k for k, v in enumerate(model.shape_values) if (v.term, v.joint) == (term, joint)}
    values = [model.shape_values[k] for k in own.values()]
    tried = effect.tries({v.shape.name: (v.low, v.high) for v in values})
    busy = any(v.held or model.shapes[k] != v.shape.start for k, v in zip(own.values(), values) if v.held or v.shape.start is not None)
    if busy or not tried:
        return None
    scale = np.ones(model.robot.dof) if weights is None else np.asarray(weights)
    projection = Projection(rows.columns, rows.residual(found.x), prior_hessian(found), scale)
    gains = []
    for change in row.secants(model, motion, row.bent(model, motion, found.x, joint), effect, tried, found.stride, rows.use):
        c, _, _, gain, _ = projection.step(change[:, :, None], joint)
        gains.append(gain if c[0] > 0 else 0.0)
    if not max(gains) > 0:
        return None
    best = {own[name]: at for name, at in tried[int(np.argmax(gains))].items()}
    return model.with_shapes([best.get(k, s) for k, s in enumerate(model.shapes)])


def _descended(best: Settled, motion: Motion, solved, weights, tolerance: float) -> Settled:
    """Damped Gauss-Newton over all shape values that are not held."""
    damping, scale = 1e-3, np.ones(best.model.robot.dof) if weights is None else np.asarray(weights)
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
            for _ in range(6):
                diagonal = np.diagonal(system)
                step = np.zeros(len(values))
                step[inside] = inverted(system + damping * np.diag(np.where(diagonal > 0, diagonal, 1.0))) @ right
                moved = np.clip(np.array(best.model.shapes) + step, low, high)
                tried = solved(best.model.with_shapes(moved))
                if tried is not None and tried.objective < best.objective:
                    best, damping = tried, max(damping * 0.1, 1e-9)
                    break
                damping *= 10.0
        if not abs(before - best.objective) > tolerance * abs(before):
            break
    return best


def _moving(best: Settled, motion: Motion, free, scale, low, high):
    """The free shape values that no bound holds back, their normal equations, and what a whole step would lower the objective by:
    where that is nothing to speak of, none need be tried."""
    system, right = _normal(best, motion, free, scale)
    at = np.array(best.model.shapes)[free]
    inside = ~((at <= low[free]) & (right < 0) | (at >= high[free]) & (right > 0))
    system, right = system[np.ix_(inside, inside)], right[inside]
    return np.array(free)[inside], system, right, 0.5 * float(right @ inverted(system) @ right) if inside.any() else 0.0


def _renewed(best: Settled, solved, share: float) -> tuple[Settled, float]:
    """The model with the load of the bodies found so far, and the share of the way to it that may be gone next time.

    A link that moves by itself answers other bodies' load with blows at other times: there a share that raises the objective
    is not gone, and the next one is half of it.
    """
    new, old = _bodies(best), best.model.reference
    if old is None or not best.model.deflects:
        return solved(best.model.with_reference(new)) or best, share
    tried = solved(best.model.with_reference(old + share * (new - old))) or best
    return (tried, min(2.0 * share, 1.0)) if tried.objective <= best.objective else (best, 0.5 * share)


def _normal(found: Settled, motion: Motion, free, scale):
    """Normal equations of the shape values on what the linear parameters leave."""
    rows = found.rows
    slopes = row.tangents(found.model, motion, found.x, found.stride, rows.use)[:, :, free]
    residual = rows.residual(found.x)
    base = sum(2.0 * w**2 * a.T @ a for w, a in zip(scale, rows.columns)) + prior_hessian(found)
    cross = sum(2.0 * w**2 * a.T @ t for w, a, t in zip(scale, rows.columns, slopes))
    system = sum(2.0 * w**2 * t.T @ t for w, t in zip(scale, slopes)) - cross.T @ inverted(base) @ cross
    right = sum(2.0 * w**2 * t.T @ r for w, t, r in zip(scale, slopes, residual.T))
    return system, right
