"""What these logs could have shown: the smallest size of every effect on every joint that they
would have named.

A group is named where its statistic stands above the null's threshold and where it is worth having.
Its coefficient is known to a standard deviation that the blocks tell; the size is the one that
passes both in nine of ten logs.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache, partial

import numpy as np
from scipy.special import ndtri

from ..blocks import Belief, ratio_at
from ..candidate_columns import at_start, leading_of
from ..candidates import Candidate
from ..model_parameters import ROBOT
from ..view import View
from .ask import Asked
from .evidence import Group
from .select import LEVEL, WORTH

POWER = 0.9


@dataclass(frozen=True)
class Detectable:
    """The smallest `size` of an effect's leading parameter that these logs would have named with
    probability `power`, at the shape values `at` that show it best; None where the model absorbs it
    whatever its size."""

    candidate: Candidate
    parameter: str
    unit: str
    size: float | None = None
    power: float = POWER
    at: dict[str, float] = field(default_factory=dict)


def detectable(view: View, asked: Asked, candidates) -> list[Detectable]:
    """For every candidate's best set of shape values and variant."""
    threshold = asked.threshold(LEVEL)
    loss = np.maximum(np.sum(view.design.residual**2, axis=0), 1e-300)
    best, leading = dict[tuple, Detectable](), cache(partial(leading_of, view.model))
    for candidate in candidates:
        # a force from outside has none until somebody says when it acts
        if candidate.parameters and not candidate.begins:
            best.setdefault(candidate.key, Detectable(candidate, *leading(candidate)))
    for group in asked.groups:
        size, begins = np.inf, at_start(group.candidate, group.shapes)
        # not of variants that its name alone does not add, nor of blows that do not strike yet
        if group.candidate.by_name and not (group.candidate.blows and begins):
            size = _size(group, threshold, loss, asked.belief)
        if group.candidate.nonlinear and not begins:
            # its torque is no multiple of another size's: this one is seen or it is not
            own = group.shapes[leading(group.candidate)[0]]
            size = own if size <= own else np.inf
        there = best.get(group.candidate.key)
        if there and np.isfinite(size) and (there.size is None or size < there.size):
            name, unit = leading(group.candidate)
            at = {shape: own for shape, own in group.shapes.items() if shape != name}
            best[group.candidate.key] = Detectable(group.candidate, name, unit, size, POWER, at)
    return list(best.values())


def _size(group: Group, threshold: float, loss: np.ndarray, belief: Belief) -> float:
    """Of the first own coefficient alone; infinite where too few blocks let nothing stand out."""
    group = group.tested
    if not (group.sizes[0] > 0 and group.testable):
        return np.inf
    directions, (spread, rest) = group.freedom[0], belief.moderated(*group.spreads)
    needed = np.sqrt(ratio_at(threshold, directions, rest) * spread)
    least = loss.min() if group.candidate.joint == ROBOT else loss[group.candidate.joint]
    # what it takes of rows that it was not fitted on, one variance less, must be worth having
    worth = np.sqrt(WORTH / (1.0 - WORTH) * least + spread / directions)
    # the coefficient scatters, and so do the spreads that this log tells and the other one
    chance = ndtri(POWER) * np.sqrt(spread / directions + needed**2 / rest)
    return float((max(needed, worth) + chance) / group.sizes[0])
