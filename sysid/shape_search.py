"""The search for a whole model's shape values: blocks of them started from many places, and the
profile over each checked.

A block is what one torque effect has on one joint: its landscape is cheap (`landscape`). Values of
effects that change the motion or the sensor begin where they do nothing, and each point of their
profile is a fit of its own, everything linear solved for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import multistart
from .blows import striking
from .effect import SensorEffect, TorqueEffect
from .landscape import at_zero, landscape
from .model import Model
from .motion import Motion
from .multistart import Searched

_SOLVED = 3  # of the best places, which are solved with every bound kept
_ROUNDS = 4  # of profiles
_LOWER = 1e-8  # share of the objective that is lower
_POINTS = 8  # of a profile each of whose points is a fit of its own

Block = tuple[int, int]  # a term and a joint


@dataclass(frozen=True)
class Search:
    """How a model is searched on a motion.

    weights: (joints,) or None. solved: a model with everything linear solved for, None where an
    effect is no finite number. descended: what was found with all shape values gone downhill.
    rough: the same as `solved` on fewer rows, which say where a profile is worth looking at.
    """

    motion: Motion
    weights: np.ndarray | None
    solved: Callable
    descended: Callable
    rough: Callable

    def started(self, best, found=()) -> tuple:
        """The best of many places of each block in turn, and {block: how many}; of blocks that were
        found before, where they are."""
        tally = {}
        for block in blocks(best.model, self.motion):
            if block not in found:
                best, tally[block] = self._from_places(best, block)
        return best, tally

    def _from_places(self, best, block: Block) -> tuple:
        own, count = _own(best.model, block), 0
        wanted = [best.model.shape_values[k].begin for k in own]
        # first as if no coefficient had a bound, then with those that came to it
        for pinned in (False, True):
            if pinned and not at_zero(best):
                break
            fine = self._seen(best, block, pinned)
            rough = self._seen(best, block, pinned, multistart.ROWS)
            asked = [here if at is None else at for here, at in zip(fine.here, wanted)]
            tried = _tried(best.model, own)
            found, sets = multistart.places(rough, fine, tried, [fine.here, asked])
            count += sets
            for place in found[:_SOLVED]:
                best = _lower(best, self.solved(best.model.with_some_shapes(dict(zip(own, place.values)))), 0.0)
        return best, count

    def _seen(self, best, block: Block, pinned: bool, rows: int | None = None):
        return landscape(best, self.motion, *block, self.weights, rows=rows, pinned=pinned)

    def profiled(self, best, tally: dict[Block, int]) -> tuple:
        """The model after the profile over each shape value was checked, the search gone on from
        where one is lower, and what was done about each value."""
        lower, points = set(), {}
        for _ in range(_ROUNDS):
            before, free, strikes = best, blocks(best.model, self.motion), striking(best.model)
            for block in free:
                own = _own(best.model, block)
                further, counts = self._along_block(best, block, own)
                points |= dict(zip(own, counts))
                lower |= set(own) if further is not best else set()
                best = further
            for k, value in enumerate(best.model.shape_values):
                effect = best.model.terms[value.term][0]
                factor = isinstance(effect, SensorEffect) and effect.constant_gain
                if value.held or factor or (value.term, value.joint) in (*free, *strikes):
                    continue  # over a factor the objective has one hollow, and what strikes was looked at all about
                further, points[k] = self._along_value(best, k, value)
                lower |= {k} if further is not best else set()
                best = further
            if best is before:
                break
        return best, tuple(
            Searched(v.name, tally.get((v.term, v.joint), 1), points.get(k, 0), k in lower)
            for k, v in enumerate(best.model.shape_values)
            if not v.held
        )

    def _along_block(self, best, block: Block, own: list[int]) -> tuple:
        counts: list[int] = []
        for pinned in (True, False) if at_zero(best) else (True,):
            seen = self._seen(best, block, pinned)
            place, counts = multistart.lower_on_profile(seen, _tried(best.model, own), _LOWER)
            if place is not None:
                best = self._gone_on(best, self.solved(best.model.with_some_shapes(dict(zip(own, place.values)))))
        return best, counts

    def _along_value(self, best, k: int, value) -> tuple:
        values = [best.model.shapes[k], *np.linspace(value.low, value.high, _POINTS)]
        tried = [self.rough(best.model.with_some_shapes({k: at})) for at in values]
        found = [one for one in tried if one is not None]
        lowest = min(found, key=lambda one: one.objective, default=None)
        if lowest is tried[0]:
            return best, _POINTS
        return self._gone_on(best, self.solved(lowest.model)), _POINTS

    def _gone_on(self, best, found):
        """The better of two, the search gone on from the other where it is lower."""
        return best if _lower(best, found, _LOWER) is best else self.descended(found)


def blocks(model: Model, motion: Motion) -> list[Block]:
    """The blocks of a model's free shape values, on joints that a motion tells something of."""
    silent = (*motion.still, *motion.unused)
    found = dict.fromkeys((v.term, v.joint) for v in model.shape_values if not v.held)
    effects = {term: model.terms[term][0] for term, _ in found}
    return [
        (term, joint)
        for term, joint in found
        if isinstance(effects[term], TorqueEffect)
        and effects[term].coefficients()
        and model.robot.joints[joint] not in silent
    ]


def _lower(best, found, share: float):
    """What was found where it is lower by a share of the objective."""
    there = found is not None and found.objective < best.objective * (1.0 - share)
    return found if there else best


def _own(model: Model, block: Block) -> list[int]:
    """Which of a model's shape values are a block's, and free."""
    values = enumerate(model.shape_values)
    return [k for k, v in values if (v.term, v.joint) == block and not v.held]


def _tried(model: Model, own: list[int]) -> list[np.ndarray]:
    values = [model.shape_values[k] for k in own]
    angle = None if model.scales is None else float(model.scales.angle[values[0].joint])
    return [np.asarray(v.shape.values(v.low, v.high, angle), dtype=float) for v in values]
