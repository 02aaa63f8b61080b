"""What a model leaves of blocks of time that it was not fitted on, in units of how well it can tell
them; what the angles' noise alone makes of that is taken off.
"""

from __future__ import annotations

import numpy as np

from .. import blocks
from .design import by_block
from .view import View

_STEPS = 4


def losses(view: View, number: np.ndarray) -> np.ndarray:
    """(blocks, dof) what a model leaves in each block `number` (n,), fitted on the other folds,
    times what it leaves fitted on all, less what the angles' noise makes: the quadratic form of the
    predictive density (Geisser & Eddy 1979), in which a fold that no other tells counts little.
    """
    design, spans = view.design, by_block(number)
    fold = blocks.folds(len(spans))
    pairs = (design.columns, design.residual), (design.rough_columns, design.rough_residual)
    # the angles' noise stands in columns and residual alike, and bends what is fitted: steps towards
    # what would be fitted without it; of a direction of which noise is half, 3 % is left to go
    (more, noise), step = pairs[1], np.zeros(design.columns.shape[2])
    of_noise = sum(one.T @ one for one in more)
    for _ in range(_STEPS):
        step = of_noise @ step - np.einsum("jnk,nj->k", more, noise)
    pairs = [(a, r - np.einsum("jnk,k->nj", a, step)) for a, r in pairs]
    out = np.zeros((len(spans), len(view.weights)))
    for f in range(fold.max() + 1):
        own = np.flatnonzero(fold == f)
        rows = slice(spans[own[0]].start, spans[own[-1]].stop)
        (a, r), (more, noise) = [(a[:, rows], r[rows]) for a, r in pairs]
        pull = np.einsum("jnk,nj->k", a, r) - np.einsum("jnk,nj->k", more, noise)
        rest = np.eye(a.shape[2]) - sum(one.T @ one for one in a)
        change = np.linalg.lstsq(rest, pull, rcond=1e-10)[0]
        whole, of_noise = (
            (r + np.einsum("jnk,k->nj", a, change)) * r for a, r in ((a, r), (more, noise))
        )
        out[own] = np.add.reduceat(whole - of_noise, [spans[b].start - rows.start for b in own])
    return out


def taken(view: View, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """The share (dof,) of each joint's loss in a view that goes, of losses (blocks, dof)."""
    whole = before.sum(0) + np.sum(view.design.rough_residual**2, axis=0)
    return (before - after).sum(0) / np.maximum(whole, 1e-300)
