"""The values that a model is not linear in: found by variable projection, before everything else is solved.

For fixed shape values the problem is the convex one of `solve`. Values of torque effects without a natural start are
first tried over a grid, one at a time, with everything linear solved for each; then all values move together by
Gauss-Newton steps on what the linear parameters leave (Golub & Pereyra 1973), damped, within their bounds. The load
that some effects look at is that of the bodies found so far, and is renewed with every step: measured torque in its
place would bring its noise into the columns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import rows as row
from .compress import Compressed, Factor, triangle
from .effect import Deflection, TorqueEffect
from .estimate import Fit, Problem, pose
from .inertia import DIVERGENCES
from .model import Model, moving_coefficients
from .motion import Motion
from .prior_weight import number, with_weight
from .objective import add_blocks
from .specs import Experiment

_MOST_ROWS, _STEPS, _SETTLED = 6000, 12, 1e-7
_LEAST_SHARE = 0.25  # of the way to another load


@dataclass(frozen=True)
class Settled:
    """A model with its shape values found, the linear parameters x there, and the rows that both were found on."""

    model: Model
    x: np.ndarray
    problem: Problem
    rows: row.Rows
    stride: int
    objective: float


def condensed(model: Model, rows: row.Rows) -> Compressed:
    """Rows as triangles, one a joint."""
    factors = []
    for joint in range(model.robot.dof):
        support = model.support(joint)
        kept = rows.use[:, joint]
        stacked = np.concatenate([rows.columns[joint][kept][:, support], rows.tau[kept, joint, None]], axis=1)
        factors.append(Factor(joint, 0, support, triangle(stacked), int(kept.sum())))
    return Compressed(model.size, model.robot.dof, tuple(factors), len(rows.t))


def settle(experiment: Experiment, model: Model, motion: Motion, prior: np.ndarray, *, weights=None, stride: int | None = None, grid: bool = True, hold: bool = False, tolerance: float = _SETTLED) -> Settled:
    """Find a model's shape values and its load on a motion.

    Args:
        weights: (joints,) that multiply the rows of each joint, or None.
        stride: which rows; by default as many as suffice.
        grid: search grids of values that have no start; without it the model's own values are where the search begins.
        hold: leave the shape values and the load as the model has them.
        tolerance: share of the objective by which a step must lower it for another to follow.
    """
    stride = stride or row.stride_for(motion, _MOST_ROWS)
    lighter = with_weight(experiment, number(experiment) / stride)
    moving = moving_coefficients(model, motion)

    def solved(candidate: Model) -> Settled:
        rows = row.stack(candidate, motion, stride)
        problem = pose(lighter, candidate, condensed(candidate, rows), moving, prior, weights)
        solution = problem.solve(lighter)
        return Settled(candidate, solution.x, problem, rows, stride, solution.objective)

    best = solved(model)
    if hold:
        return best
    if model.uses_load:
        best = solved(best.model.with_reference(_bodies(best)))
    if grid:
        for k, value in enumerate(best.model.shape_values):
            effect = best.model.terms[value.term][0]
            if isinstance(effect, TorqueEffect) and not value.held and value.shape.start is None:
                if (tried := _from_grid(best, motion, k, weights)) is not None:
                    best = min(best, solved(tried), key=lambda s: s.objective)
        for term, (effect, joints) in enumerate(best.model.terms):
            for joint in joints if isinstance(effect, Deflection) else ():
                if (tried := _from_tries(best, motion, term, joint, weights)) is not None:
                    best = min(best, solved(tried), key=lambda s: s.objective)
    return _descended(best, motion, solved, weights, tolerance)


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


def _from_grid(found: Settled, motion: Motion, k: int, weights) -> Model | None:
    """The model with the best of the grid's values for one shape value, everything linear solved for each."""
    model, rows = found.model, found.rows
    value = model.shape_values[k]
    effect = model.terms[value.term][0]
    own = [i for i, c in enumerate(model.coefficients) if c.effect == effect.name and c.joint == value.joint]
    rest = np.setdiff1d(np.arange(model.size), 10 * model.bodies + np.array(own))
    scale = np.ones(model.robot.dof) if weights is None else np.asarray(weights)
    others_alone = rows.columns[:, :, rest]
    hessian = prior_hessian(found)[np.ix_(rest, rest)]
    projection = Projection(others_alone, _without(others_alone, rows.tau, hessian, scale), hessian, scale)
    pieces = row.seen(model, motion)
    others = model.shapes_of(value.term, value.joint)
    positive = np.array([linear.lower == 0 for linear in effect.coefficients()])
    gains = []
    angle = None if model.scales is None or value.joint < 0 else float(model.scales.angle[value.joint])
    tried = value.shape.values(value.low, value.high, angle)
    for at in tried:
        columns = row.signature(model, motion, pieces, effect, value.joint, {**others, value.shape.name: float(at)}, found.stride, rows.use)
        c, _, _, gain, _ = projection.step(columns, value.joint)
        gains.append(0.0 if np.any(c[positive] < 0) else gain)
    if not max(gains) > 0:
        return None
    return model.with_shapes([tried[int(np.argmax(gains))] if i == k else s for i, s in enumerate(model.shapes)])


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


def _without(columns, tau, hessian, weights) -> np.ndarray:
    """What least squares with the prior leave of tau (n, dof)."""
    system = sum(2.0 * w**2 * a.T @ a for w, a in zip(weights, columns)) + hessian
    x = inverted(system) @ sum(2.0 * w**2 * a.T @ t for w, a, t in zip(weights, columns, tau.T))
    return tau - np.einsum("jnk,k->nj", columns, x)


def prior_hessian(found: Settled) -> np.ndarray:
    """The prior's Hessian (size, size) where a model settled, zero for coefficients."""
    out = np.zeros((found.model.size, found.model.size))
    return add_blocks(out, found.problem.objective.beside_data(found.x)) if found.problem.objective.says else out


class Projection:
    """What the linear parameters leave of a signature: least squares with the prior, the same for every candidate."""

    def __init__(self, columns, residual, hessian, weights, positive=None):
        """columns (dof, n, size), residual (n, dof) at the optimum, hessian (size, size) of the prior, weights (dof,); positive:
        {parameter: value at the optimum} of those that must not fall below zero."""
        self.columns, self.residual, self.weights = columns, residual, np.asarray(weights)
        self.positive = dict(positive or {})
        self._system = sum(2.0 * w**2 * a.T @ a for w, a in zip(self.weights, columns)) + hessian
        self.inverse = inverted(self._system)
        self._inverses: dict[tuple[int, ...], np.ndarray] = {}
        # where a parameter is held at zero the objective still falls away from it: it is no stationary point
        self._pull = np.zeros(len(self._system))
        for k in self.positive:
            self._pull[k] = sum(2.0 * w**2 * a[:, k] @ r for w, a, r in zip(self.weights, columns, residual.T))

    def _rest(self, pinned: tuple[int, ...]) -> np.ndarray:
        """The inverse (size, size) where some parameters may not move, zero for these."""
        if pinned not in self._inverses:
            rest = np.setdiff1d(np.arange(len(self._system)), pinned)
            self._inverses[pinned] = np.zeros_like(self._system)
            self._inverses[pinned][np.ix_(rest, rest)] = inverted(self._system[np.ix_(rest, rest)])
        return self._inverses[pinned]

    def step(self, columns, joint: int):
        """Least squares when columns (n, k) of a joint, or (dof, n, k) of the robot, come in.

        Returns:
            their coefficients c (k,); the change (size,) of everything else; what everything else absorbs of them (size, k);
            what the objective falls by; which share (k,) of each column's square everything else cannot absorb.
        """
        cross, square, right = 0.0, 0.0, 0.0
        for j in range(len(self.weights)) if columns.ndim == 3 else [joint]:
            own = columns[j] if columns.ndim == 3 else columns
            w = 2.0 * self.weights[j] ** 2
            cross = cross + w * (self.columns[j].T @ own)
            square = square + w * (own.T @ own)
            right = right + w * (own.T @ self.residual[:, j])
        absorbed = self.inverse @ cross
        system = square - cross.T @ absorbed
        size = np.diagonal(square)
        visible = np.clip(np.diagonal(system), 0.0, None) / np.where(size > 0, size, 1.0)
        pinned, gone, inverse = (), np.zeros(len(self._system)), self.inverse
        for _ in range(len(self.positive) + 1):
            # the least of 1/2 d'Hd - pull'd + d'Xc + 1/2 c'Sc - right'c, with the pinned d taking their parameters to zero
            base = inverse @ (self._pull + self._system @ gone)
            c = inverted(system) @ (right + cross.T @ gone - cross.T @ base)
            change = base - absorbed @ c - gone
            # friction that would help by turning negative is taken to zero, and stays there
            below = [k for k, value in self.positive.items() if k not in pinned and value + change[k] < -1e-9 * abs(value)]
            if not below:
                break
            pinned = tuple(sorted({*pinned, *below}))
            gone[list(pinned)] = [self.positive[k] for k in pinned]
            inverse = self._rest(pinned)
            absorbed = inverse @ cross
            system = square - cross.T @ absorbed
        gain = float(c @ right + self._pull @ change) - 0.5 * float(c @ square @ c + 2.0 * change @ cross @ c + change @ self._system @ change)
        return c, change, absorbed, gain, visible


def inverted(system: np.ndarray) -> np.ndarray:
    """Inverse of a positive semidefinite matrix on its range."""
    diagonal = np.diagonal(system)
    there = diagonal > 1e-100
    scale = np.sqrt(np.where(there, diagonal, 1.0))
    values, vectors = np.linalg.eigh(np.where(np.outer(there, there), system, 0.0) / np.outer(scale, scale))
    keep = values > max(1e-11 * values[-1], 1e-100)
    return (vectors[:, keep] / values[keep]) @ vectors[:, keep].T / np.outer(scale, scale)


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
                if tried.objective < best.objective:
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
        return solved(best.model.with_reference(new)), share
    tried = solved(best.model.with_reference(old + share * (new - old)))
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
