"""What a claim is not told from, in words: other effects, and other options of the same."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..candidates import Candidate
from .words import Members, option, percent, placed

if TYPE_CHECKING:
    from ..diagnose.diagnosis import Diagnosis


def as_little(found: Diagnosis) -> dict[str, set[tuple[str, str]]]:
    """Of each claim's command the (effect, joint) of its set that leave as little as its head, by
    more numbers."""
    return {
        claim.head.command: {
            m.candidate.named(found.fit.joints)
            for m in claim.step.choice.as_little
            if m.candidate.parameters > claim.head.candidate.parameters
        }
        for claim in found.claims
    }


def rivals(members: Members, own: dict, little: set[tuple[str, str]]) -> list[str]:
    """What a finding is not told from, with probabilities; and of what is much less likely, though
    it leaves as little, why."""
    out = []
    why = ", which leaves as little and needs more numbers"
    for e, j, p in members:
        least = (e, j) in little and p < 0.5 * own["probability"]
        out.append(f"{placed(e, j, own['joint'])} ({percent(p)}{why * least})")
    return out


def or_options(own: Candidate, forms: tuple[Candidate, ...]) -> list[dict]:
    """The options of an effect's other forms, where they are others than its own: each once, those
    that only one of the two names by their defaults."""
    names = {name for one in (own, *forms) for name, _ in one.options}
    value = lambda one, name: getattr(one.effect, name, None)  # noqa: E731
    found = [
        {n: value(one, n) for n in sorted(names) if value(one, n) != value(own, n)} for one in forms
    ]
    return [one for k, one in enumerate(found) if one and one not in found[:k]]


def other_options(forms: list[dict]) -> list[str]:
    """The same as it is typed."""
    return [
        " and ".join(f"{name}={option(value)}" for name, value in form.items()) for form in forms
    ]
