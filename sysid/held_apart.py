"""How strong should the prior be? `prior.weight: auto`.

The training logs are cut into stretches of time; each is predicted by fits, one a weight, that
never saw it. The strongest prior is taken whose error on these stretches is within one standard
error of the best, each joint's error in units of its own: what the log does not determine stays
near its prior, and what it does is not bent by more than the log itself could tell. Stretches are
made of triangles, so a fit of all but one costs a solve, not a pass over the samples. Test logs
are not touched.

Source: Breiman, Friedman, Olshen & Stone 1984, 3.4.3 (one standard error), here of differences
between weights on the same stretches, in which what all weights share cancels.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from .blocks import standard_error, within_one_error
from .model import Model, moving_coefficients
from .motion import Motion
from .posed_problem import Problem, known_bodies, noise_weights, pose
from .prior_weight import USUAL, PriorWeight, is_auto, weakest, with_weight
from .specs import Experiment
from .triangles import Compressed

_STRETCHES = 8
FEWEST = 3  # of fewer no standard error can be told
_DECADES = 12  # below the strongest: weaker than that a prior is rounding of what the data say
_CLEAR = 3.0  # standard errors above the best: no weight beyond it will be within one
_NOTHING = 1e-4  # of an error: what a tenth of a weight changes where it has ceased to matter
_NONE = 1e-300  # what stands for a weight of nothing where logarithms are taken
_TOLERANCE = 1e-6  # its square, as a share of the objective, is far below any standard error


@dataclass(frozen=True)
class HeldApart:
    """Stretches of a log held apart: of each the problem without it, and its triangles; and the
    joints' weights (joints,)."""

    problems: tuple[Problem, ...]
    stretches: tuple[Compressed, ...]
    weights: np.ndarray
    _solved: dict[float, np.ndarray] = field(default_factory=dict, repr=False, compare=False)

    @property
    def rows(self) -> np.ndarray:
        """(stretches, joints) rows that count."""
        return np.array([stretch.rows for stretch in self.stretches])

    def squares(self, weight: float, tolerance: float = _TOLERANCE) -> np.ndarray:
        """(stretches, joints) sum of squared residuals of each, under fits of the others with a
        prior of `weight`.

        Each begins where the one before it ended, the first where the nearest weight's first did.
        """
        away = lambda w: abs(np.log(max(w, _NONE) / max(weight, _NONE)))  # noqa: E731
        nearest = min(self._solved, key=away, default=None)
        out, x = [], self._solved.get(nearest)
        for problem, stretch in zip(self.problems, self.stretches):
            x = solved(problem, weight, tolerance, near=x)
            self._solved.setdefault(weight, x)
            out.append(stretch.squares(x))
        return np.array(out)


def solved(
    problem: Problem, weight: float, tolerance: float = _TOLERANCE, near: np.ndarray | None = None
) -> np.ndarray:
    """The parameters (size,) of a problem under another weight of its prior.

    Args:
        near: those of a problem that differs a little, where they are at hand.
    """
    problem = replace(problem, objective=replace(problem.objective, weight=weight))
    found = None if near is None else problem.from_nearby(near, tolerance)
    if found is not None:
        return found
    return problem.minimum(tolerance)


def held_apart(
    experiment: Experiment, model: Model, data: Compressed, moving, prior, weights=None
) -> HeldApart:
    """The stretches of a log.

    Args:
        moving: (coefficients,) bool. prior: (bodies, 10). weights: (joints,) or None.
    """
    parts = data.stretches(_STRETCHES)
    data, numbers = data.gathered(parts), range(len(parts))
    problems = [pose(experiment, model, data.without([k]), moving, prior, weights) for k in numbers]
    alone = [data.without(set(numbers) - {k}) for k in numbers]
    scale = np.ones(data.joints) if weights is None else np.asarray(weights)
    return HeldApart(tuple(problems), tuple(alone), scale)


def chosen(
    experiment: Experiment, model: Model, data: Compressed, moving, prior, before=None
) -> PriorWeight:
    """The weight of an experiment's prior: as given, or chosen on its training data.

    Args:
        moving: (coefficients,) bool. prior: (bodies, 10). before: a PriorWeight that was chosen for
            a model like this one.
    """
    if not is_auto(experiment):
        return PriorWeight(experiment.prior.weight)
    if data.blocks < FEWEST or len(known_bodies(experiment, model)) == model.bodies:
        return PriorWeight(USUAL, auto=True)
    begin = None if before is None or before.errors is None else before.value
    found = strongest(held_apart(experiment, model, data, moving, prior), begin)
    weights = joint_weights(with_weight(experiment, found.value), model, data, moving, prior)
    if weights is None:
        return found
    return strongest(held_apart(experiment, model, data, moving, prior, weights))


def joint_weights(
    experiment: Experiment, model: Model, data: Compressed, moving, prior
) -> np.ndarray | None:
    """(joints,) by which each joint's rows count, under a weight of the prior that is a number; None
    where all count alike.

    Args:
        moving: (coefficients,) bool. prior: (bodies, 10).
    """
    if experiment.solver.weighting != "noise":
        return None
    whole = pose(experiment, model, data, moving, prior)
    return noise_weights(data, solved(whole, experiment.prior.weight))


def strongest(apart: HeldApart, begin: float | None = None) -> PriorWeight:
    """The strongest prior within one standard error of the best, and none that is weaker than what
    a URDF says at all: by decades from the middle of what a prior can be, both ways, up to where
    the error stands clear above the best or changes no more.

    Args:
        begin: a weight near which it is, from which the search goes down no further than to an
            error that rises.
    """
    top = int(np.ceil(np.log10(_greatest(apart.problems[0]))))
    middle, rows = top - _DECADES // 2, apart.rows
    if begin is not None:
        middle = int(np.clip(np.floor(np.log10(begin)), top - _DECADES, top))
    found = {float(f"1e{middle}"): apart.squares(float(f"1e{middle}"))}
    for way in (range(middle + 1, top + 1), range(middle - 1, top - _DECADES - 1, -1)):
        for power in way:
            weight, last = float(f"1e{power}"), float(f"1e{power - way.step}")
            if way.step < 0 and last < _weakest(apart, found):
                break
            found[weight] = apart.squares(weight)
            errors, best = judged(np.array([*found.values()]), rows)
            own, before = (errors[[*found].index(w)] for w in (weight, last))
            worse = own - errors[best]
            if worse.sum() > _CLEAR * standard_error(worse):
                break
            if way.step < 0 and abs(own.mean() - before.mean()) <= _NOTHING * before.mean():
                break
            if way.step < 0 and begin is not None and own.mean() > before.mean():
                break
    for step in (_below, above):
        _try(apart, found, step(_least(found, rows)))
    _try(apart, found, above(_within(found, rows)))
    value, least = _within(found, rows), _weakest(apart, found)
    if bounded := bool(value < least):
        value = float(f"1e{int(np.floor(np.log10(least)))}")
        while value < least:
            value = above(value)
        _try(apart, found, value)
    tried = tuple(sorted(found))
    errors, _ = judged(np.array([found[w] for w in tried]), rows)
    return PriorWeight(value, True, tried, errors, bounded)


def _weakest(apart: HeldApart, found: dict[float, np.ndarray]) -> float:
    """As `prior_weight.weakest`, with the noise that the best leaves; 0 where the divergence does
    not count in shares of a body."""
    if not apart.problems[0].objective.divergence.relative:
        return 0.0
    squares = found[_least(found, apart.rows)]
    return weakest(float(np.sum(squares * apart.weights**2) / max(apart.rows.sum(), 1)))


def _try(apart: HeldApart, found: dict[float, np.ndarray], weight: float) -> None:
    if weight not in found:
        found[weight] = apart.squares(weight)


def judged(squares, rows) -> tuple[np.ndarray, int]:
    """Errors (weights, stretches) and the number of the least: mean squares in units of what this
    one leaves each joint, so that a loud joint, or one that lacks something, does not drown what a
    prior costs the quiet ones. The least has the greatest likelihood of joints whose noise nobody
    knows: the sum of the logarithms of their squares is least.

    Args:
        squares: (weights, stretches, joints). rows: (stretches, joints) that count.
    """
    squares, counts = np.asarray(squares, dtype=float), np.asarray(rows)
    level = squares.sum(1) / np.maximum(counts.sum(0), 1)
    seen = np.flatnonzero(counts.sum(0) * level.min(0) > 0.0)
    best = int(np.argmin((np.log(level[:, seen]) * counts.sum(0)[seen]).sum(1)))
    scaled = (squares[:, :, seen] / level[best, seen]).sum(2)
    return scaled / np.maximum(counts[:, seen].sum(1), 1), best


def _least(found: dict[float, np.ndarray], rows) -> float:
    return [*found][judged(np.array([*found.values()]), rows)[1]]


def _within(found: dict[float, np.ndarray], rows) -> float:
    errors, best = judged(np.array([*found.values()]), rows)
    return max(w for w, kept in zip(found, within_one_error(errors, best)) if kept)


def above(weight: float) -> float:
    """The next of 1, 3, 10, 30, ..."""
    digit, power = f"{weight:.0e}".split("e")
    return float(f"3e{power}" if digit == "1" else f"1e{int(power) + 1}")


def _below(weight: float) -> float:
    """The one before."""
    digit, power = f"{weight:.0e}".split("e")
    return float(f"1e{power}" if digit == "3" else f"3e{int(power) - 1}")


def _greatest(problem: Problem) -> float:
    """The weight at which the prior is as stiff as the data in the direction that they tell best:
    beyond it nothing is left of them. Bodies that are known are no data's."""
    objective = problem.objective
    metric = np.asarray(objective.divergence.hessian(objective.divergence.prior))
    columns = objective.triangle[:, : 10 * objective.bodies].reshape(-1, objective.bodies, 10)
    roots = np.linalg.inv(np.linalg.cholesky(metric))
    scaled = np.einsum("rbk,blk->rbl", columns, roots)
    if objective.known is not None:
        scaled = scaled[:, ~objective.known.any(axis=(1, 2))]
    size = np.linalg.norm(scaled.reshape(len(scaled), -1), ord=2) if scaled.size else 0.0
    return max(2.0 * float(size) ** 2, np.finfo(float).tiny)


def prior_strength(experiment: Experiment, structure: Model, motion: Motion, data: Compressed, prior, before: PriorWeight | None = None) -> PriorWeight:
    """The weight of the prior on training data, which may hold slopes of shape values after the model's own parameters.

    Gains are found anew on what is held apart, to first order: what a gain is and what the bodies weigh is one product, and
    gains that a strong prior chose would let no other weight be better.

    Args:
        before: what was chosen for the model before its shape values were found.
    """
    if not is_auto(experiment):
        return PriorWeight(experiment.prior.weight)
    if data.size > structure.size:
        free = [k for k, value in enumerate(structure.shape_values) if not value.held]
        data = data.only([*range(structure.size), *(structure.size + at for at, k in enumerate(free) if k in structure.gains)])
    return chosen(experiment, structure, data, moving_coefficients(structure, motion), prior, before)
