"""Whether a claim's law is a simpler one: one of its numbers is nothing beside its deviation, and
an effect without such a number tells as much."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from . import comparison
from .borne_out import CLEAR, first_borne_out
from .estimate import Fit
from .view import View, holds


def with_simpler(
    choice, view: View, last: Fit, fits: dict, with_: Callable, may: Callable[..., bool]
):
    """A choice whose head a fit bore out, or with a simpler effect at its head and the old head
    beside it, as likely.

    The simpler effect is one that the head's columns hold, by a fit of its own it is borne out, and
    its test error is no more than a standard error greater. So an offset, of which the law of a
    spring fits a little more, is no spring: the stiffness is nothing beside its deviation.

    Args:
        choice: of effects that may be in each other's place. view: of the model without them.
        last: its fit. fits: {id of a member: its fit}, the head's among them; those made here join.
        with_: fits the model with a member. may: whether a member may join, as no fit refused it.
    """
    head = choice.head
    fit = fits[id(head)]
    own = fit.parameters_of(*head.candidate.key).values()
    if all(abs(at) >= CLEAR * std for at, std, _ in own if std == std):
        return choice
    simple = []
    for member in (m for m in choice.close if may(m) and holds(view, head, m)):
        found, told, _ = first_borne_out([member], last, with_)
        if found is member:
            fits |= told
            risen = comparison.together(fit, told[id(member)])
            simple += [member] if risen.delta_rms <= risen.se else []
    if not simple:
        return choice
    chance = next(p for member, p in choice.members if member is head)
    least = dict.fromkeys(map(id, simple), chance)
    every = [*choice.members, *((m, 0.0) for m in choice.beaten if id(m) in least)]
    every = [(m, max(p, least.get(id(m), 0.0))) for m, p in every]
    every.sort(key=lambda one: (-one[1], id(one[0]) not in least))
    whole = sum(p for _, p in every)
    best = min(simple, key=lambda member: member.candidate.simplicity)
    grown = replace(
        choice,
        members=tuple((m, p / whole) for m, p in every),
        beaten=tuple(m for m in choice.beaten if id(m) not in least),
        gain=choice.gain + (head.losses - best.losses).sum(axis=1),
    )
    return grown.headed(best)
