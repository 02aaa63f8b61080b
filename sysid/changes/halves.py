"""Which changes one half of a log tells of the other: each is fitted on one and judged on the
other.

Squares of columns and residual, block by block, hold all that is asked: no question goes back to
the rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy import stats

from ..blocks import folds, z_score
from ..projection import inverted

BLOCKS, _MOST = 24, 12  # blocks, over the whole log; changes
_ALIKE = 1.01  # times what the best leaves: by less no half tells one change from another
# of the squared residual: below it, a held model's errors on another motion look like changes
_WORTH = 0.1

Key = tuple[str, int]  # an effect's word and its joint


@dataclass(frozen=True)
class Question:
    """A held model on a new log, and what each change would add to it.

    spans: {change: its columns}; products: (blocks, dof, k + 1, k + 1) of the columns of all
    changes, then the residual of the held model; weights: (dof,) by which joints count. wide:
    {change: whether other joints than its own feel it}.
    """

    spans: dict[Key, slice]
    products: np.ndarray
    weights: np.ndarray
    wide: dict[Key, bool]
    _kept: dict = field(default_factory=dict, repr=False, compare=False)

    def weighed(self, weights) -> Question:
        """The same question with other weights."""
        return replace(self, weights=weights, _kept={})

    def places(self, keys: Sequence[Key]) -> list[int]:
        """The columns of some changes, one after the other."""
        return [k for key in keys for k in range(self.spans[key].start, self.spans[key].stop)]

    @cached_property
    def halves(self) -> np.ndarray:
        """(blocks,) bool, those of the first half."""
        return folds(len(self.products), 2) == 0

    @cached_property
    def by_block(self) -> np.ndarray:
        """(blocks, k + 1, k + 1) products over all joints, weighed."""
        return np.einsum("bjkl,j->bkl", self.products, self.weights**2)

    def squares(self, places: Sequence[int], c) -> np.ndarray:
        """(blocks, dof) sums of squares that coefficients c (blocks, k) of columns leave."""
        at = [*places, self.products.shape[-1] - 1]
        own = self.products[:, :, at][:, :, :, at]
        v = np.append(-np.atleast_2d(c), np.ones((len(np.atleast_2d(c)), 1)), axis=1)
        v = np.broadcast_to(v, (len(own), len(at)))
        return np.maximum(np.einsum("bk,bjkl,bl->bj", v, own, v), 0.0)

    def across(self, keys: Sequence[Key]) -> np.ndarray:
        """Sums of squares (blocks, dof) that each half leaves after what the other half says of
        some changes."""
        if (known := frozenset(keys)) not in self._kept:
            places, c = self.places(keys), np.zeros((len(self.products), 0))
            if places:
                c = np.empty((len(self.products), len(places)))
                for half in (self.halves, ~self.halves):
                    c[half] = least_squares(self.by_block[~half].sum(axis=0), places)
            self._kept[known] = self.squares(places, c)
        return self._kept[known]

    def weighted_sum(self, key: Key, squares: np.ndarray) -> np.ndarray:
        """(blocks,) sums of squares (blocks, dof) over the joints of a change, as they count."""
        joints = slice(None) if self.wide[key] else [key[1]]
        return (squares * self.weights**2)[:, joints].sum(1)

    def share(self, key: Key, before, after) -> float:
        """What a change takes of sums of squares (blocks, dof) on its joints, as they count."""
        first, then = (self.weighted_sum(key, own) for own in (before, after))
        return float(np.sum(first - then) / max(np.sum(first), 1e-300))

    def evenly(self, key: Key, before, after) -> float:
        """How many standard errors the share that a change takes of each block's own square stands
        from zero: where the change is clear, all blocks say so, however much each has of it."""
        first, then = (self.weighted_sum(key, own) for own in (before, after))
        return z_score((first - then) / np.maximum(first + then, 1e-300))

    def supported(self, least: float) -> list[Key]:
        """The changes that the halves support, what takes most first, each beside all others.

        Args:
            least: standard errors that each must stand from zero `evenly`.
        """
        chosen: list[Key] = []
        while len(chosen) < _MOST:
            new = {k: self._beside(k, chosen, least) for k in self.spans if k not in chosen}
            found = {key: share for key, share in new.items() if share is not None}
            if not found:
                break
            # of what takes as much the first that is asked
            least_left = 1.0 - max(found.values())
            chosen.append(next(key for key in found if 1.0 - found[key] <= _ALIKE * least_left))
        return self.standing(chosen, least)

    def standing(self, chosen: Sequence[Key], least: float) -> list[Key]:
        """Of changes those that the halves support beside all others: what joined first may have
        stood for what joined after it, a bias for a load."""
        left = list(chosen)
        for key in chosen:
            others = [other for other in left if other != key]
            if self._beside(key, others, least) is None:
                left = others
        return left

    def _beside(self, key: Key, others: Sequence[Key], least: float) -> float | None:
        """What a change takes beside others; None where the halves do not support it."""
        before, after = self.across(others), self.across([*others, key])
        share = self.share(key, before, after)
        clear = share >= _WORTH and self.evenly(key, before, after) >= least
        return share if clear else None


def support(rate: float, questions: int) -> float:
    """How many standard errors a change must stand from zero `evenly`, that any of so many
    questions is answered wrongly with no more than a probability: by Student's law of the blocks,
    after Bonferroni."""
    return float(stats.t.isf(0.5 * rate / questions, BLOCKS - 1))


def question(columns: dict[Key, np.ndarray], residual, weights, blocks) -> Question:
    """A question of rows.

    Args:
        columns: {change: (dof, n, k)}. residual: (n, dof) of the held model. weights: (dof,).
        blocks: (n,) the block of each row.
    """
    ends = np.cumsum([own.shape[2] for own in columns.values()]).tolist()
    spans = {key: slice(e - own.shape[2], e) for (key, own), e in zip(columns.items(), ends)}
    count, dof = int(blocks.max()) + 1, residual.shape[1]
    wide = {
        key: any(np.any(own[j]) for j in range(dof) if j != key[1]) for key, own in columns.items()
    }
    products = np.zeros((count, dof, ends[-1] + 1, ends[-1] + 1))
    for j in range(dof):
        felt = [key for key in columns if wide[key] or key[1] == j]
        at = [k for key in felt for k in range(spans[key].start, spans[key].stop)]
        own = [columns[key][j] for key in felt]
        every = np.column_stack([*own, residual[:, j]])
        at = np.array([*at, ends[-1]])
        for b in range(count):
            part = every[blocks == b]
            products[b, j][np.ix_(at, at)] = part.T @ part
    return Question(spans, products, np.asarray(weights), wide)


def least_squares(products, places: Sequence[int]) -> np.ndarray:
    """Coefficients (k,) of columns that leave least of the last, by their products."""
    return inverted(products[np.ix_(places, places)]) @ products[places, -1]
