"""Which explanations a log cannot tell apart: candidates refitted exactly, and the set of them that holds the best.

Each candidate joins the model and everything is settled again, its shape values and the load included. What each model
leaves of blocks that it was not fitted on is one loss a block; what the angles' noise alone makes of that is taken off.
The set of explanations is the model confidence set of these losses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import blocks
from ..estimate import inverse
from .candidates import Candidate, bounds_of, columns_of, grown
from .evidence import Group
from .view import View, by_block, looked_at

_OUTSIDE = 0.10  # a model is outside the set of 90 % where its p-value is below
_COMPARED = 1e-4  # share of the objective: finer than rivals are ever told apart by
_SAME = 0.99  # share of a candidate's torque that another one's columns hold


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
        """Shape values at which to ask for it again: its own, and of an effect without columns those where it does nothing."""
        return self.group.shapes if self.candidate.nonlinear else self.shapes

    @property
    def shapes(self) -> dict[str, float]:
        """Its shape values, refitted."""
        return {value.shape.name: at for value, at in zip(*_own(self.view))}


@dataclass(frozen=True)
class Choice:
    """The head and, by falling probability, all that these logs cannot tell from it: members with their probabilities.
    gain (blocks,): what the head takes of the model's weighted loss in each block. general: those that hold the head and more,
    which say no more than that something is there."""

    head: Member
    members: tuple[tuple[Member, float], ...]
    gain: np.ndarray
    general: tuple[Member, ...] = ()

    @property
    def decided(self) -> bool:
        """Whether the log says which joint it is, or at least which is likelier than all others together."""
        joints = {member.candidate.joint for member, _ in self.members}
        return len(joints) == 1 or self.members[0][1] >= 0.5


def losses(view: View, number: np.ndarray) -> np.ndarray:
    """(blocks, dof) weighted squares that a model leaves in each block `number` (n,), fitted on the other folds, less what the
    angles' noise makes."""
    design, spans = view.design, by_block(number)
    fold = blocks.folds(len(spans))
    out = np.zeros((len(spans), len(view.weights)))
    for f in range(fold.max() + 1):
        own = [span for b, span in enumerate(spans) if fold[b] == f]
        rows = slice(own[0].start, own[-1].stop)
        a, r = design.columns[:, rows], design.residual[rows]
        pull = np.einsum("jnk,nj->k", a, r)
        squares = np.einsum("jnk,jnl->kl", a, a, optimize=True)
        change = np.linalg.lstsq(design.system - squares, pull, rcond=1e-10)[0]
        left = r + np.einsum("jnk,k->nj", a, change)
        for b, span in enumerate(spans):
            if fold[b] == f:
                part = slice(span.start - rows.start, span.stop - rows.start)
                out[b] = np.sum(left[part] ** 2 - design.rough_residual[span] ** 2, axis=0)
    return out


def refitted(view: View, group: Group) -> Member | None:
    """A group's candidate in the model, everything settled again; None where its sign or its bounds forbid it."""
    candidate = group.candidate
    shapes = dict(group.shapes)
    if candidate.nonlinear:
        free = [s for s, *_ in bounds_of(view.model, candidate) if s.start is not None]
        limits = {s.name: (low, high) for s, low, high, _ in bounds_of(view.model, candidate)}
        for shape, step in zip(free, group.coefficients):
            shapes[shape.name] = float(np.clip(shapes[shape.name] + step, *limits[shape.name]))
    found = joined(view, candidate, shapes)
    return Member(group, found, losses(found, view.blocks)) if _allowed(found, candidate) else None


def joined(view: View, candidate: Candidate, shapes: dict[str, float]) -> View:
    """A view's model with a candidate, everything settled again from shape values on."""
    return looked_at(
        view.experiment, grown(view.source, candidate, shapes), view.motion, view.rough, view.prior, stride=view.stride,
        weights=view.weights, grid=False, tolerance=_COMPARED, inherited=view.blocks,
    )  # fmt: skip


def _allowed(view: View, candidate: Candidate) -> bool:
    """Whether the coefficients that may not be negative are not."""
    model, first = view.model, 10 * view.model.bodies
    x = view.settled.x + view.design.change[: model.size]
    own = [k for k, c in enumerate(model.coefficients) if (c.effect, c.joint) == candidate.key]
    if any(model.coefficients[k].positive and x[first + k] <= 0.0 for k in own):
        return False
    starts = [(v, at) for v, at in zip(model.shape_values[model.last_shapes], model.shapes[model.last_shapes]) if v.shape.start is not None]
    return not starts or any(at != v.shape.start for v, at in starts)


def chosen(view: View, groups: list[Group], rng: np.random.Generator) -> Choice | None:
    """The best of some candidates, refitted, and those that cannot be told from it; None where none may be."""
    members = [m for m in (refitted(view, g) for g in groups) if m is not None]
    if not members:
        return None
    base = losses(view, view.blocks).sum(1)
    table = np.stack([m.losses.sum(1) for m in members], axis=1)
    members, table = _least(members, table, rng)
    p = blocks.confidence_set(table, rng)
    inside = [k for k in np.argsort(table.sum(0)) if p[k] >= _OUTSIDE]
    priced = table + _price(members, int(np.argmin(table.sum(0))))
    # the best, and of two that are the same the simplest: not what rounding left with less
    best = priced[:, inside].sum(0).min() + blocks.SAME * np.abs(table).sum(0).min()
    head = min((k for k in inside if priced[:, k].sum() <= best), key=lambda k: members[k].candidate.simplicity)
    general = [k for k in inside if k != head and holds(view, members[k], members[head])]
    inside = [k for k in inside if k not in general]
    chance = dict(zip(inside, blocks.chances(priced[:, inside], rng)))
    order = sorted(inside, key=lambda k: (k != head, -chance[k]))
    return Choice(
        members[head], tuple((members[k], float(chance[k])) for k in order), base - table[:, head], tuple(members[k] for k in general)
    )  # fmt: skip


def _price(members: list[Member], best: int) -> np.ndarray:
    """(members,) what each member's numbers cost it in every block.

    Blocks held apart ask who predicts best, and what holds the truth and more predicts about as well as the truth. Who is
    the truth is another question: a number then costs the logarithm of the count of blocks times the variance of one
    direction (that of the `best` member), of which holding apart has charged two.

    Source: Schwarz 1978; Akaike 1973 for the two.
    """
    count, group = len(members[best].losses), members[best].group
    one = np.sum(group.moves**2) / len(group.c)
    return np.array([m.group.numbers for m in members]) * one * max(np.log(count) - 2.0, 0.0) / count


def _least(members: list[Member], table: np.ndarray, rng: np.random.Generator):
    """Of each candidate the simplest variant that the log cannot tell from the best of them; of several, what loses least."""
    kept: dict = {}
    for k, member in enumerate(members):
        kept.setdefault(member.candidate.key, []).append(k)
    at = []
    for own in kept.values():
        p = blocks.confidence_set(table[:, own], rng) if len(own) > 1 else np.ones(1)
        inside = [k for k, chance in zip(own, p) if chance >= _OUTSIDE]
        at.append(min(inside, key=lambda k: (members[k].candidate.parameters, table[:, k].sum())))
    return [members[k] for k in at], table[:, at]


def holds(view: View, general: Member, special: Member) -> bool:
    """Whether one explanation only adds freedom to another: its columns hold the other's torque, and it has more numbers."""
    one, other = general.candidate, special.candidate
    if one.nonlinear or one.parameters <= other.parameters or one.joint != other.joint:
        return False
    columns = columns_of(view.source, one, [general.shapes])[0]
    joints = one.touches(view.model.robot.dof)
    target = (special.view.source.predicted - view.source.predicted) * view.rows.use * view.weights
    base = view.design.columns[joints].reshape(-1, view.design.columns.shape[2])
    flat = (columns * view.weights[joints][:, None, None]).reshape(-1, columns.shape[2])
    wanted = target[:, joints].T.ravel()
    rest = lambda a: wanted - a @ np.linalg.lstsq(a, wanted, rcond=1e-9)[0]  # noqa: E731
    alone = np.sum(rest(base) ** 2)
    return bool(alone > 0 and np.sum(rest(np.concatenate([base, flat], axis=1)) ** 2) < (1.0 - _SAME) * alone)


def alike(view: View, one: Group, other: Group) -> bool:
    """Whether two candidates take the same part of what a model leaves, the greater half of it at least: then one of them in
    the model leaves the other little to do, on whichever joints they stand."""
    first, second = _taken(view, one), _taken(view, other)
    return bool(np.sum(first * second) ** 2 > 0.5 * np.sum(first**2) * np.sum(second**2))


def _taken(view: View, group: Group) -> np.ndarray:
    """(dof, n) weighted torque that a group takes of the residual, the model's own columns refitted."""
    design, joints = view.design, group.candidate.touches(view.model.robot.dof)
    own = columns_of(view.source, group.candidate, [group.shapes])[0] @ group.coefficients * view.weights[joints, None]
    out = np.zeros(design.columns.shape[:2])
    out[joints] = own
    absorbed = design.inverse @ np.einsum("jnk,jn->k", design.columns, out)
    return out - np.einsum("jnk,k->jn", design.columns, absorbed)


def _own(view: View):
    own = view.model.last_shapes
    return view.model.shape_values[own], view.model.shapes[own]


def weighed(view: View) -> View:
    """The view with every joint weighted by what the model now leaves it."""
    return looked_at(
        view.experiment, view.model, view.motion, view.rough, view.prior, stride=view.stride,
        weights=inverse(view.rms()), grid=False, inherited=view.blocks,
    )  # fmt: skip
