"""Candidates refitted exactly: each joins the model and everything is settled again, its shape
values and the load included; with what it leaves of each block of time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..candidate_columns import at_start, bounds_of, grown
from ..candidates import Candidate
from ..posed_problem import inverse
from ..view import View, looked_at, losses
from .evidence import Group

COMPARED = 1e-4  # share of the objective: finer than rivals are ever told apart by


@dataclass(frozen=True)
class Member:
    """A candidate refitted: the view of the model with it, and its losses (blocks, dof)."""

    group: Group
    view: View
    losses: np.ndarray

    @property
    def candidate(self) -> Candidate:
        """What joined."""
        return self.group.candidate

    @property
    def asked(self) -> dict[str, float]:
        """Shape values at which to ask for it again: its own, and of an effect without columns
        those where it does nothing."""
        return self.group.shapes if self.candidate.nonlinear else self.shapes

    @property
    def shapes(self) -> dict[str, float]:
        """Its shape values, refitted."""
        model, own = self.view.model, self.view.model.last_shapes
        return {v.shape.name: at for v, at in zip(model.shape_values[own], model.shapes[own])}


def refitted(view: View, group: Group) -> Member | None:
    """A group's candidate in the model, everything settled again; None where its sign or its bounds
    forbid it."""
    candidate = group.candidate
    shapes = dict(group.shapes)
    if candidate.nonlinear and at_start(candidate, shapes):
        free = [s for s, *_ in bounds_of(view.model, candidate) if s.start is not None]
        limits = {s.name: (low, high) for s, low, high, _ in bounds_of(view.model, candidate)}
        for shape, step in zip(free, group.coefficients):
            shapes[shape.name] = float(np.clip(shapes[shape.name] + step, *limits[shape.name]))
    found = joined(view, (candidate, shapes))
    return Member(group, found, losses(found, view.blocks)) if _allowed(found, candidate) else None


def joined(view: View, *added: tuple[Candidate, dict[str, float]], like: View | None = None):
    """The view of a view's model with candidates, all settled again from their shape values on.

    Args:
        like: whose weights and noise it has, where these are not to be its own.
    """
    source = view.source
    for candidate, shapes in added:
        source = replace(source, model=grown(source, candidate, shapes))
    return _again(view, source.model, (like or view).weights, tolerance=COMPARED, like=like)


def _allowed(view: View, candidate: Candidate) -> bool:
    """Whether the coefficients that may not be negative are not."""
    model, first = view.model, 10 * view.model.bodies
    x = view.settled.x + view.design.change[: model.size]
    own = [k for k, c in enumerate(model.coefficients) if (c.effect, c.joint) == candidate.key]
    if any(model.coefficients[k].positive and x[first + k] <= 0.0 for k in own):
        return False
    own = zip(model.shape_values[model.last_shapes], model.shapes[model.last_shapes])
    starts = [(v.shape.start, at) for v, at in own if v.shape.start is not None]
    return not starts or any(at != start for start, at in starts)


def weighed(view: View, weights=None) -> View:
    """The view with every joint weighted anew.

    Args:
        weights: (dof,), to compare it by, its noise as known; None: what it now leaves each joint.
    """
    how = {} if weights is None else {"tolerance": COMPARED, "like": view}
    return _again(view, view.model, inverse(view.rms()) if weights is None else weights, **how)


def _again(view: View, model, weights, **how) -> View:
    how |= {"stride": view.stride, "weights": weights, "grid": False, "grown": view}
    return looked_at(view.experiment, model, view.motion, view.rough, view.prior, **how)
