"""Candidates refitted exactly: each joins the model and everything is settled again, its shape
values and the load included; with what it leaves of each block of time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..candidate_columns import at_start, stepped
from ..candidates import Candidate
from ..view import View, allowed, around, joined, losses, shapes_of, weighed
from .evidence import Group
from .projected import groups_at


@dataclass(frozen=True, eq=False)
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
        return shapes_of(self.view, self.candidate)


def refitted(view: View, group: Group, found: View | None = None) -> Member | None:
    """A group's candidate in the model, everything settled again; None where its sign or its bounds
    forbid it, or where it leaves more than the model without it. found: where it is at hand."""
    candidate, shapes = group.candidate, dict(group.shapes)
    if found is None and candidate.nonlinear and at_start(candidate, shapes):
        shapes = stepped(view.model, candidate, shapes, group.coefficients)
    strikes = candidate.blows and candidate.swings  # from hollow to hollow no slope leads
    found = found or joined(view, (candidate, shapes), strikes=strikes)
    left = [np.sum(one.design.residual**2) for one in (view, found)]
    may = allowed(found, candidate) and left[1] <= left[0]
    return Member(group, found, losses(found, view.blocks)) if may else None


def settled(view: View, group: Group) -> Group | None:
    """A group about where everything settles with its candidate, each joint weighed by what is left
    of it there; None where it may not join, or stands in the place of what the model has of it."""
    member = None if group.candidate.begins else refitted(view, group)
    after = member and weighed(member.view)
    if after is None or not allowed(after, member.candidate):
        return None
    seen = around(view, after, member.candidate)
    found = groups_at(seen, [(member.candidate, shapes_of(after, member.candidate))])
    # what it takes stands in the noise no more
    return replace(found[0], loss=np.inf) if found else None
