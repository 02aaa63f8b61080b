"""Which changes one half of a log tells of the other: each is fitted on one and judged on the
other."""

from __future__ import annotations

import numpy as np

from ..blocks import away, folds, summed
from ..model import ROBOT
from ..shape import inverted

BLOCKS, _MOST = 24, 12  # blocks, over the whole log; changes
_SUPPORT = 3.0  # standard errors
# of the squared residual: below it, a held model's errors on another motion look like changes
_WORTH = 0.1


def chosen_of(tried, residual, weights, blocks) -> list[tuple]:
    """The changes that the halves of the log support, each fitted on one and judged on the
    other."""
    halves = folds(blocks.max() + 1, 2)[blocks] == 0
    chosen: list[tuple] = []
    current = across(tried, chosen, residual, weights, halves)
    while len(chosen) < _MOST:
        best = None
        for key in tried:
            if key in chosen:
                continue
            after = across(tried, [*chosen, key], residual, weights, halves)
            own = slice(None) if key[1] == ROBOT else [key[1]]
            fall = summed(blocks, ((current**2 - after**2) * weights**2)[:, own]).sum(1)
            share, far = (
                float(fall.sum() / max(np.sum((current * weights)[:, own] ** 2), 1e-300)),
                away(fall),
            )
            if share >= _WORTH and far >= _SUPPORT and (best is None or share > best[0]):
                best = (share, key, after)
        if best is None:
            return chosen
        chosen, current = [*chosen, best[1]], best[2]
    return chosen


def across(tried, keys, residual, weights, halves) -> np.ndarray:
    """The residual of each half after what the other half says of the changes."""
    if not keys:
        return residual
    columns = np.concatenate([tried[key] for key in keys], axis=2)
    out = np.empty_like(residual)
    for half in (halves, ~halves):
        c = least_squares(columns[:, ~half], residual[~half], weights)
        out[half] = residual[half] - np.einsum("jnk,k->nj", columns[:, half], c)
    return out


def least_squares(columns, residual, weights) -> np.ndarray:
    """Coefficients (k,) of columns (dof, n, k) that leave least of residual (n, dof), weighted."""
    system = sum(w**2 * a.T @ a for w, a in zip(weights, columns))
    return inverted(system) @ sum(w**2 * a.T @ r for w, a, r in zip(weights, columns, residual.T))
