"""Which changes one half of a log tells of the other: each is fitted on one and judged on the
other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..blocks import folds, summed, z_score
from ..model import ROBOT
from ..projection import inverted

BLOCKS, _MOST = 24, 12  # blocks, over the whole log; changes
_SUPPORT = 3.0  # standard errors
# of the squared residual: below it, a held model's errors on another motion look like changes
_WORTH = 0.1

Key = tuple[str, int]  # an effect's word and its joint


@dataclass(frozen=True)
class Question:
    """A held model on a new log, and what each change would add to it.

    columns: {change: (dof, n, k)}; residual: (n, dof) of the held model; weights: (dof,) by which
    joints count; blocks: (n,) the block of each row.
    """

    columns: dict[Key, np.ndarray]
    residual: np.ndarray
    weights: np.ndarray
    blocks: np.ndarray

    def stacked(self, keys: Sequence[Key]) -> np.ndarray:
        """Columns (dof, n, k) of some changes, one after the other."""
        return np.concatenate([self.columns[key] for key in keys], axis=2)

    @cached_property
    def halves(self) -> np.ndarray:
        """(n,) bool, the rows of the first half."""
        return folds(self.blocks.max() + 1, 2)[self.blocks] == 0

    def across(self, keys: Sequence[Key]) -> np.ndarray:
        """The residual (n, dof) of each half after what the other half says of some changes."""
        if not keys:
            return self.residual
        columns, out = self.stacked(keys), np.empty_like(self.residual)
        for half in (self.halves, ~self.halves):
            c = least_squares(columns[:, ~half], self.residual[~half], self.weights)
            out[half] = self.residual[half] - np.einsum("jnk,k->nj", columns[:, half], c)
        return out

    def taken(self, key: Key, before, after) -> tuple[float, float]:
        """The share that a change takes of a residual's weighted square on its joints, and how many
        standard errors it stands from zero."""
        joints = slice(None) if key[1] == ROBOT else [key[1]]
        fall = summed(self.blocks, ((before**2 - after**2) * self.weights**2)[:, joints]).sum(1)
        whole = max(np.sum((before * self.weights)[:, joints] ** 2), 1e-300)
        return float(fall.sum() / whole), z_score(fall)

    def supported(self) -> list[Key]:
        """The changes that the halves support, the one that takes most first, each beside those."""
        chosen: list[Key] = []
        current = self.residual
        while len(chosen) < _MOST:
            found = {}
            for key in self.columns:
                if key not in chosen:
                    after = self.across([*chosen, key])
                    share, z = self.taken(key, current, after)
                    if share >= _WORTH and z >= _SUPPORT:
                        found[key] = (share, after)
            if not found:
                break
            best = max(found, key=lambda key: found[key][0])
            chosen, current = [*chosen, best], found[best][1]
        return chosen


def least_squares(columns, residual, weights) -> np.ndarray:
    """Coefficients (k,) of columns (dof, n, k) that leave least of residual (n, dof), weighted."""
    system = sum(w**2 * a.T @ a for w, a in zip(weights, columns))
    return inverted(system) @ sum(w**2 * a.T @ r for w, a, r in zip(weights, columns, residual.T))
