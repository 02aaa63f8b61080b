"""What a model leaves of blocks of time that it was not fitted on, in units of how well it can tell
them; what the angles' noise alone makes of that is taken off.
"""

from __future__ import annotations

import numpy as np

from .. import blocks
from ..landscape import at_zero
from ..lowpass import calm
from .design import freed, instrumented
from .view import View


def losses(view: View, number: np.ndarray) -> np.ndarray:
    """(blocks, dof) what a model leaves in each block `number` (n,), fitted on the other folds,
    times what it leaves fitted on all, less what the angles' noise makes: the quadratic form of the
    predictive density (Geisser & Eddy 1979), in which a fold that no other tells counts little.

    Row by row it is the square of (1 - H)^(-1/2) r, with H what the fold has of the fit: the product
    itself is one only of a fold, and its parts may be of either sign.
    """
    design, spans = view.design, blocks.by_block(number)
    fold = blocks.folds(len(spans))
    out = np.zeros((len(spans), len(view.weights)))
    for f in range(fold.max() + 1):
        own = np.flatnonzero(fold == f)
        rows = slice(spans[own[0]].start, spans[own[-1]].stop)
        a, r = design.columns[:, rows], design.residual[rows]
        squares = sum(one.T @ one for one in a)
        change = freed(squares[None])[0] @ np.einsum("jnk,nj->k", a, r)
        told = (r + np.einsum("jnk,k->nj", a, change)) ** 2 - design.rough_residual[rows] ** 2
        out[own] = np.add.reduceat(told, [spans[b].start - rows.start for b in own])
    return out


def slow_losses(view: View, number: np.ndarray) -> np.ndarray:
    """(blocks,) what a model leaves that is as slow as the motion, its parameters told by columns
    without the noise of the angles, less what that noise makes of it: of what is fast it is most,
    how much of it stands in a prediction hangs on how a model reads torque, and it bends a fit."""
    design, use, how = view.design, view.rows.use, (view.rows.piece, view.motion.band, view.step)
    left, change = instrumented(design, use, *how)
    more = design.rough_residual - np.einsum("jnk,k->nj", design.rough_columns, change)
    told = np.sum(calm(left * use, *how) ** 2 - calm(more, *how) ** 2, axis=1)
    return np.add.reduceat(told, [rows.start for rows in blocks.by_block(number)])


def taken(view: View, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """The share (dof,) of each joint's loss in a view that goes, of losses (blocks, dof)."""
    whole = before.sum(0) + np.sum(view.design.rough_residual**2, axis=0)
    return (before - after).sum(0) / np.maximum(whole, 1e-300)


def took(view: View, after: View) -> tuple[np.ndarray, np.ndarray]:
    """What the model of `after` leaves less than that of a view, in its blocks (blocks,), and the
    share (dof,) of each joint's loss."""
    base, then = (losses(one, view.blocks) for one in (view, after))
    return (base - then).sum(axis=1), taken(view, base, then)


def taken_where_held(view: View, after: View) -> np.ndarray:
    """The share (dof,) of each joint's squares in a view that goes as fits have them, of joints whose
    friction the view holds at zero, of others none: a design is free of that bound, and negative
    friction, which no joint has, is most of a Stribeck effect in slow motion."""
    model, whole, left = view.model, view.rms() ** 2, after.rms() ** 2
    bound = (model.coefficients[k] for k in at_zero(view.settled))
    held = {c.joint for c in bound if c.effect in ("coulomb", "viscous")}
    here = np.isin(np.arange(len(whole)), sorted(held)) & (whole > 0.0)
    return np.where(here, 1.0 - left / np.maximum(whole, 1e-300), 0.0)
