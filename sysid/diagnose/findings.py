"""What a diagnosis says of one effect: its parameters, its error and its command are those of the
fit that has it."""

from __future__ import annotations

from dataclasses import dataclass

from .. import comparison
from ..addition import command, spelled
from ..borne_out import size_told
from ..estimate import Fit
from .refits import Member
from .steps import Step


@dataclass(frozen=True)
class Finding:
    """A candidate that these logs support.

    joint: its name, or `*`. p: family-wise p-value of its set; probability: of being the best of
    its set. rms_before, rms_after: on the test logs, on its joint (over all joints for `*`), of the
    fits without it and with it. parameters: {name: (value, std or NaN, unit)} of the fit with it,
    of a claim with all that is claimed; size_told: whether they say how large it is. step: which
    step of the search it heads, or None. command: what adds it. forms: as of `Choice`, of a head.
    """

    member: Member
    joint: str
    p: float
    probability: float
    rms_before: float
    rms_after: float
    fall_se: float
    parameters: dict[str, tuple[float, float, str]]
    size_told: bool
    step: int | None
    command: str
    forms: tuple = ()

    @property
    def candidate(self):
        """What would join."""
        return self.member.candidate

    @property
    def effect(self) -> str:
        """The effect's word."""
        return self.candidate.name


def finding(
    before: Fit, after: Fit, member: Member, chance: float, step: Step, number: int
) -> Finding:
    """A member of a set, from the fits without it and with it; number: of its step."""
    candidate = member.candidate
    own, joint = candidate.judged_by(before.joints), candidate.where(before.joints)
    errors = comparison.over(before, after, own)
    heads = number if member is step.choice.head else None
    added = command(before.experiment.path, *spelled(candidate, joint))
    numbers = after.parameters_of(*candidate.key), size_told(after, *candidate.key)
    forms = step.choice.forms if heads is not None else ()
    return Finding(member, joint, step.p, chance, *errors, *numbers, heads, added, forms)
