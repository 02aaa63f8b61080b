"""What needs fewer numbers than a claim and tells as much: a law of which a number is nothing beside its deviation may be a simpler one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from . import comparison
from .estimate import Fit

_NOTHING = 2.0  # standard deviations


def with_simpler(choice, fits: dict, fit_with: Callable[..., Fit]):
    """A choice that a fit bore out, with what is simpler at its head where the log holds no number that it lacks: of an offset the law of
    a spring fits a little more, the stiffness that says so is nothing beside its deviation, and the offset alone predicts test logs as well.

    Args:
        choice: of effects that may be in each other's place. fits: {id of a member: its fit}, the head's among them; those made here join.
        fit_with: fits the model with a member.
    """
    head, fit = choice.head, fits[id(choice.head)]
    values = fit.parameters_of(*head.candidate.key).values()
    if all(abs(at) >= _NOTHING * std for at, std, _ in values if std == std):
        return choice
    at, known, simple = head.candidate.joint, {id(m) for m, _ in choice.members}, []
    for member in choice.close:
        if member.candidate.joint == at and member.group.numbers < head.group.numbers:
            fits[id(member)] = fits.get(id(member)) or fit_with(member)
            risen = comparison.together(fit, fits[id(member)])
            simple += [member] if risen.delta_rms <= risen.se else []
    if not simple:
        return choice
    chance = dict.fromkeys(map(id, simple), next(p for m, p in choice.members if m is head))
    every = [(m, max(p, chance.get(id(m), 0.0))) for m, p in choice.members] + [(m, chance[id(m)]) for m in simple if id(m) not in known]
    whole = sum(p for _, p in every)
    members = tuple((m, p / whole) for m, p in sorted(every, key=lambda one: (-one[1], id(one[0]) not in chance)))
    kept = {id(m) for m, _ in members}
    choice = replace(choice, members=members, beaten=tuple(m for m in choice.beaten if id(m) not in kept))
    return choice.headed(min(simple, key=lambda member: member.candidate.simplicity))
