"""Which explanations a log cannot tell apart: of candidates refitted exactly, the set that holds
the best.

The set of explanations is the model confidence set of their losses over blocks held apart; who
heads it, or hardly ever would, is told by these losses and by how many numbers each one needs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from .. import blocks
from ..candidates import Candidate
from ..view import COMPARED, View, even, holds, losses, slow_losses, taken, weighed
from .evidence import Group
from .projected import groups_at
from .refits import Member, refitted

_OUTSIDE, _HARDLY = 0.10, 0.01  # outside the set of 90 %: p-value; chance of all such together
NEAR = 0.4  # of what the best takes, as all are asked at once: by less no refit makes it the best
_SAME = 0.01  # of what the head takes: by less nobody sees the difference
_CLOSE = 0.1  # of what the head takes: by less another may have lost to what still acted then


@dataclass(frozen=True)
class Choice:
    """The head and, by falling probability, all that these logs cannot tell from it: members with
    their probabilities. gain (blocks,): what the head takes of the model's weighted loss in each
    block; shares (dof,): of each joint's loss. beaten: all others that were refitted; where one of
    them is there, it is the head that is. forms: the head's effect with other options, which these
    logs cannot tell from it either."""

    head: Member
    members: tuple[tuple[Member, float], ...]
    gain: np.ndarray
    beaten: tuple[Member, ...] = ()
    shares: np.ndarray | None = None
    forms: tuple[Candidate, ...] = ()

    @property
    def decided(self) -> bool:
        """Whether the log says which joint it is, or at least which is likelier than all others
        together, with those that leave the same to what a refit is settled to."""
        lost = np.array([member.losses.sum() for member, _ in self.members])
        same = np.abs(lost - lost[0]) <= COMPARED * abs(lost[0])
        chance = sum(p for (_, p), is_same in zip(self.members, same) if is_same)
        return len({member.candidate.joint for member, _ in self.members}) == 1 or chance >= 0.5

    @property
    def close(self) -> list[Member]:
        """All members, and of the beaten those that took nearly as much as the head."""
        most = self.head.losses.sum() + _CLOSE * self.gain.sum()
        return [*(m for m, _ in self.members), *(m for m in self.beaten if m.losses.sum() <= most)]

    @property
    def as_little(self) -> list[Member]:
        """The others that leave as little as the head, to a hundredth of what it takes: less likely
        for the numbers that they need alone."""
        most = self.head.losses.sum() + _SAME * self.gain.sum()
        return [m for m, _ in self.members if m is not self.head and m.losses.sum() <= most]

    def worth_having(self, least: float) -> bool:
        """Whether it takes that share of some joint, and more of all than its standard error."""
        return bool(
            self.shares.max() >= least and self.gain.sum() > blocks.standard_error(self.gain)
        )

    def headed(self, head: Member) -> Choice:
        """The choice with another of its members at the head."""
        members = sorted(self.members, key=lambda one: one[0] is not head)
        forms = self.forms if head is self.head else ()
        return replace(self, head=head, members=tuple(members), forms=forms)

    def without(self, there: set) -> Choice:
        """The choice without what is in the model anyway, as another step brings it."""
        kept = [(m, p) for m, p in self.members if m is self.head or m.candidate.key not in there]
        whole = sum(p for _, p in kept) or 1.0
        return replace(self, members=tuple((m, p / whole) for m, p in kept))


def chosen(view: View, groups: list[Group], rng, known: Mapping = {}) -> Choice | None:
    """The best of some candidates, refitted, and those that cannot be told from it; None where none
    may be. known: {id of a candidate: the view with it} that are at hand."""
    members = [m for g in groups if (m := refitted(view, g, known.get(id(g.candidate))))]
    if not members:
        return None
    first = view
    if (view := even(first, min(members, key=lambda m: m.losses.sum()).view)) is not first:
        grown = ((m.group, weighed(m.view, view.weights)) for m in members)
        members = [Member(group, found, losses(found, view.blocks)) for group, found in grown]
    base = losses(view, view.blocks)
    # who loses more than nobody explains nothing, however far its losses scatter
    members = [m for m in members if m.losses.sum() <= base.sum()] or members[:1]
    table = np.stack([m.losses.sum(1) for m in members], axis=1)
    # what reads torque late: alike in what is slow, and more or less of the noise of what is fast
    by_loss = sorted(members, key=lambda m: m.losses.sum())
    late = [[m for m in by_loss if m.candidate.late == j] for j in range(view.model.robot.dof)]
    for some in (some for some in late if len(some) > 1):
        own, slow = zip(*((members.index(m), slow_losses(m.view, view.blocks)) for m in some))
        table[:, own] = (table[:, own[0]] - slow[0] + slow).T
    group = members[int(np.argmin(table.sum(0)))].group
    if view is not first:  # with these weights
        group = (groups_at(view, [(group.candidate, group.shapes)]) or [group])[0]
    price = price_of(view, group)
    priced = table + np.array([price(member.group) for member in members]) / len(table)
    kept, every = _least(members, priced.sum(0)), list(zip(members, table.T))
    members, table, priced = [members[k] for k in kept], table[:, kept], priced[:, kept]
    free = table + np.array([price(m.group, signs=0.0) for m in members]) / len(table)
    p = blocks.confidence_set(table, rng)
    same, lost = blocks.SAME * np.abs(table).sum(0).min(), priced.sum(0)
    # what is least once its numbers are paid for is no worse for predicting a little less, unless
    # hardly any draw of the blocks agrees; nor is what is the same but for rounding
    least = (lost <= lost.min() + same) & (p[int(np.argmin(lost))] >= _HARDLY)
    inside = [k for k in np.argsort(table.sum(0)) if p[k] >= _OUTSIDE or least[k]]
    # the best, and of two that are the same the simplest: not what rounding left with less
    best = [k for k in inside if lost[k] <= lost[inside].min() + same]
    head = min(best, key=lambda k: members[k].candidate.simplicity)
    # no log tells that a sign was free to choose: it halves the odds
    odds, lost = np.exp2([-m.group.either for m in members]), free.sum(0)
    # nor is ruled out, as no head, whom the likelihood does not, however steadily little is lost
    likely = blocks.chances(free, np.random.default_rng(1), group.variance) >= _OUTSIDE
    named = [*inside, *(k for k in np.flatnonzero(likely) if k not in inside)]
    odds = odds[named] * blocks.chances(free[:, named], rng, group.variance)
    chance = dict(zip(named, odds / odds.sum()))
    # whom only its fewer signs made the head may be less likely than another
    wide = lambda k: k != head and holds(view, members[k], members[head])  # noqa: E731
    less = [k for k in inside if lost[k] < lost[head] - same and not wide(k)]
    head, order, told = max([head, *less], key=chance.get), list[int](), 0.0
    # a refit of what is mostly noise is bent by it: whoever is bent least goes on
    bent = [m for m in late[members[head].candidate.joint] if members[head].group.slow]
    head = next((k for k in map(members.index, bent) if k in inside), head)
    for k in sorted(chance, key=lambda k: (k != head, -chance[k])):
        # what only adds freedom predicts as well: it counts by how likely it is
        order += [] if told > 1.0 - _OUTSIDE and wide(k) else [k]
        told += chance[k]
    order = [k for n, k in enumerate(order) if not n or sum(map(chance.get, order[n:])) > _HARDLY]
    own, whole = members[head].candidate, sum(map(chance.get, order))
    apart = ((m.candidate, np.stack([table[:, head], lost], axis=1)) for m, lost in every)
    apart = ((c, both) for c, both in apart if c.key == own.key and c.kind != own.kind)
    forms = tuple(c for c, both in apart if blocks.confidence_set(both, rng)[1] >= _OUTSIDE)
    return Choice(
        members[head],
        tuple((members[k], float(chance[k] / whole)) for k in order),
        base.sum(1) - table[:, head],
        tuple(replace(m, view=replace(m.view)) for k, m in enumerate(members) if k not in order),
        taken(view, base, members[head].losses),
        forms,
    )


def price_of(view: View, group: Group) -> Callable[..., float]:
    """What the numbers of a candidate cost, of the loss of all blocks, and their signs, in units of
    the variance of one direction (that of the best one's `group`): a band holds two values a cycle
    of its cutoff."""
    values = 2.0 * view.cutoff * view.step * float(np.mean(view.rows.use.sum(0)))
    each, sign = blocks.price(values)
    return lambda other, signs=sign: group.variance * (each * other.numbers + signs * other.either)


def _least(members: list[Member], lost: np.ndarray) -> list[int]:
    """Of the variants of each candidate, the one that lost least."""
    kept: dict = {}
    for k in np.argsort(lost):
        kept.setdefault(members[k].candidate.key, int(k))
    return sorted(kept.values())
