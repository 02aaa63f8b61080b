"""What the search found, as `sysid add` gives it: each effect written into the experiment and
fitted as the user's fit is.

So what a diagnosis states is what comes of it. The test logs choose nothing; they may only refuse.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .. import comparison, pipeline
from ..addition import grown, spelled
from ..estimate import Fit
from ..experiment_logs import Read
from ..failures import taken
from ..motion import Motion
from ..unexplained import Refused, changed, nought
from .findings import Finding, finding, judged_by, where
from .refits import Member
from .steps import Step
from .ties import Choice

_NOTHING = 5e-3  # of an error: a hundredth of its square, the least that is told in per cent
_FITTED, _LIKELY = 3, 0.1  # members of a set that are fitted, and how likely; the rest is named


@dataclass(frozen=True)
class Claim:
    """A step that stands: its findings, the head first; the fits before and after the head joined;
    what may stand in its place with probabilities: [(effect, joint, probability)]."""

    step: Step
    findings: tuple[Finding, ...]
    before: Fit
    after: Fit
    set: tuple[tuple[str, str, float], ...]

    @property
    def head(self) -> Finding:
        """What is claimed."""
        return self.findings[0]

    def after_square(self, joints) -> float:
        """Mean squared error on the test logs over joints, with the head in the model."""
        return float(np.mean([self.after.rms("test")[joint] ** 2 for joint in joints]))


def claimed(
    steps: list[Step], fit: Fit, measured: Read | None, test: Motion, tell: pipeline.Progress
) -> tuple[list[Claim], list[Refused]]:
    """Fit each step's head, and the best of what is tied with it, on top of what stands before it.

    Args:
        fit: of the experiment as it is. measured: its logs; None: read anew. test: low-passed.
    """

    def with_(how: Callable, last: Fit, member: Member):
        name, joints, options = spelled(member.candidate, where(member, fit))
        spec = grown(last.experiment, name, joints, options, every=fit.joints)
        return how(spec, last, filters=fit.filters, progress=tell, measured=measured)

    claims, refused, last = list[Claim](), list[Refused](), fit
    for step in steps:
        head, *tied = step.choice.members
        after, compared = with_(pipeline.refit, last, head[0])  # and under the last one's prior
        if (why := _nothing(last, compared, after, head[0])) is not None:
            told = step.candidate, step.p, taken(step.before.settled, step.after.settled, test)
            refused.append(Refused(step.candidate.name, where(head[0], fit), why, *told))
            continue
        near = [(m, chance) for m, chance in tied[: _FITTED - 1] if chance >= _LIKELY]
        found = [(*head, after), *((*m, with_(pipeline.fit_grown, last, m[0])) for m in near)]
        findings = [finding(last, then, m, chance, step, len(claims)) for m, chance, then in found]
        named = [(m.candidate.name, where(m, fit), chance) for m, chance in step.choice.members]
        claims.append(Claim(step, tuple(findings), last, after, tuple(named)))
        last = after
    return claims, refused


def _nothing(before: Fit, after: Fit, told: Fit, member: Member) -> str | None:
    """Why an effect that the search found is not claimed, None where it is. Both are fits with it:
    after under the prior of the one before, told as `sysid add` gives it."""
    own = judged_by(member, before)
    if where(member, before) == "*":  # what held bodies against its lack may hold them against it
        after = min((after, told), key=lambda one: comparison.together(before, one).delta_rms)
    if not any(after.rms("train")[joint] < before.rms("train")[joint] for joint in own):
        return "the fit's own error does not fall with it"
    if where(member, before) == "*":
        change, unit = comparison.together(before, after), 1.0
        rise = f"{changed(change.delta_rms)} over all joints"
    else:
        changes = [comparison.compare(before, one) for one in (after, told)]
        change, shown = (next(d for d in one if d.joint == own[0]) for one in changes)
        unit = before.rms("test")[own[0]]
        rise = changed(change.delta_rms / max(unit, 1e-300))
        still = any(-d.delta_rms < d.se for d in (change, shown))
        if still and nought(told.parameters_of(*member.candidate.key)):
            return "its size is nothing beside its deviation, and the test error hardly falls"
    # what moves a joint may show in the torque of those that it carries, or that carry it
    wide = len(member.candidate.touches(2)) > 1 and comparison.falls(before, after, _NOTHING)
    if change.delta_rms > -_NOTHING * unit and not wide:
        falls = "hardly falls" if change.delta_rms < 0.0 else "does not fall"
        return f"with it the error on the test logs {falls} ({rise})"
    # as the fit weighs them: it trades what a quiet joint loses for what a loud one gains
    if (paid := comparison.together(before, after, weighed=True)).delta_rms > paid.se:
        return "with it the test error of all joints together, as the fit weighs them, rises"
    return None


def undecided(choice: Choice, fit: Fit) -> Refused:
    """What is there and cannot be told from effects on other joints."""
    likely = [(m, chance) for m, chance in choice.members if chance >= 0.05]
    names = [f"{m.candidate.name} on {where(m, fit)} ({100 * c:.0f} %)" for m, c in likely]
    why = f"something is there, and these logs cannot tell which: {', '.join(names)}"
    return Refused(choice.head.candidate.name, where(choice.head, fit), why)
