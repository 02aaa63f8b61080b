"""What the search found, as `sysid add` gives it: each effect written into the experiment and
fitted as the user's fit is.

So the parameters, the command and the error that a diagnosis states are those that come of it. The
test logs choose nothing here; they may only refuse what does not hold on them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .. import comparison, pipeline
from ..addition import command, grown, spelled
from ..estimate import Fit
from ..model import ROBOT
from ..view import View
from .refits import Member
from .steps import Step

_CLEAR = 2.0  # standard deviations
_FITTED, _LIKELY = (
    3,
    0.1,
)  # members of a set that are fitted, and how likely they must be; the rest is named


@dataclass(frozen=True)
class Finding:
    """A candidate that these logs support.

    joint: its name, or `*`. p: family-wise p-value of its set; probability: of being the best of
    its set. rms_before, rms_after: on the test logs, on its joint (over all joints for `*`), of the
    fits without it and with it. parameters: {name: (value, std or NaN, unit)} of the fit with it.
    tied_with: words of the others of its set, with their joint where it is another. step: which
    step of the search it heads, or None. command: what adds it.
    """

    member: Member
    joint: str
    p: float
    probability: float
    rms_before: float
    rms_after: float
    fall_se: float
    parameters: dict[str, tuple[float, float, str]]
    tied_with: tuple[str, ...]
    step: int | None
    command: str

    @property
    def candidate(self):
        """What would join."""
        return self.member.candidate

    @property
    def effect(self) -> str:
        """The effect's word."""
        return self.candidate.name


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


@dataclass(frozen=True)
class Refused:
    """A step that does not stand, and why, in words."""

    effect: str
    joint: str
    why: str


def claimed(
    steps: list[Step], fit: Fit, tell: Callable[[str, float], None]
) -> tuple[list[Claim], list[Refused]]:
    """Fit each step's head, and the best of what is tied with it, on top of what stands before it.

    Args:
        fit: of the experiment as it is.
    """
    claims: list[Claim] = []
    refused: list[Refused] = []
    last = fit
    for step in steps:
        members = [(m, chance) for m, chance in step.choice.members]
        head = step.choice.head
        ordered = [
            next(pair for pair in members if pair[0] is head),
            *(pair for pair in members if pair[0] is not head),
        ]
        found = []
        for member, chance in [
            ordered[0],
            *(pair for pair in ordered[1:_FITTED] if pair[1] >= _LIKELY),
        ]:
            after = _with(last, member, fit, tell)
            why = _nothing(last, after, member) if member is head else None
            if why is not None:
                refused.append(Refused(member.candidate.name, _where(member, fit), why))
                break
            found.append((member, chance, after))
        if not found:
            continue
        names = [(m.candidate.name, _where(m, fit), chance) for m, chance in members]
        claims.append(
            Claim(
                step,
                tuple(
                    _finding(last, after, member, chance, step, names, len(claims))
                    for member, chance, after in found
                ),
                last,
                found[0][2],
                tuple(names),
            )
        )
        last = found[0][2]
    return claims, refused


def _where(member: Member, fit: Fit) -> str:
    return "*" if member.candidate.joint == ROBOT else fit.joints[member.candidate.joint]


def _with(last: Fit, member: Member, first: Fit, tell) -> Fit:
    """The fit of the last experiment with a candidate in it, filtered as the first one was."""
    name, joints, options = spelled(member.candidate, _where(member, first))
    return pipeline.fit(
        grown(last.experiment, name, joints, options, every=first.joints),
        filters=first.filters,
        progress=tell,
    )


def own_joints(member_or_candidate, dof: int) -> list[int]:
    """The joints whose error an effect is judged by."""
    candidate = getattr(member_or_candidate, "candidate", member_or_candidate)
    return list(range(dof)) if candidate.joint == ROBOT else [candidate.joint]


def _nothing(before: Fit, after: Fit, member: Member) -> str | None:
    """Why an effect that the search found is not claimed, None where it is."""
    own = [before.joints[j] for j in own_joints(member, len(before.joints))]
    if not any(after.rms("train")[joint] < before.rms("train")[joint] for joint in own):
        return "the fit's own error does not fall with it"
    joint = _where(member, before)
    if joint == "*":
        change = comparison.together(before, after)
        return (
            None
            if change.delta_rms < 0.0
            else f"with it the error on the test logs does not fall ({100 * change.delta_rms:+.2g} % over all joints)"
        )
    (change,) = (d for d in comparison.compare(before, after) if d.joint == joint)
    if -change.delta_rms < change.se and _nought(_parameters(before, after, member)):
        return "its size is nothing beside its standard deviation, and the error on the test logs stays what it was"
    return (
        None
        if change.delta_rms < 0.0
        else f"with it the error on the test logs does not fall ({change.delta_rms:+.3g})"
    )


def undecided(choice, fit: Fit) -> Refused:
    """What is there and cannot be told from effects on other joints."""
    names = [
        f"{m.candidate.name} on {_where(m, fit)} ({100 * chance:.0f} %)"
        for m, chance in choice.members
        if chance >= 0.05
    ]
    head = choice.head
    return Refused(
        head.candidate.name,
        _where(head, fit),
        f"something is there, and these logs cannot tell which: {', '.join(names)}",
    )


def _nought(parameters: dict[str, tuple[float, float, str]]) -> bool:
    """Whether all of an effect's parameters that are determined are nothing beside their standard
    deviations."""
    known = [
        abs(value) <= _CLEAR * std for value, std, _ in parameters.values() if np.isfinite(std)
    ]
    return bool(known) and all(known)


def hidden_by_weights(found: Finding, fit: Fit) -> str | None:
    """What to know where the fit, in which all joints count alike, does not tell the size of an
    effect that is there."""
    if fit.weights is not None or not _nought(found.parameters):
        return None
    return (
        f"{found.effect} on {found.joint} is there, but this fit tells its size badly: joints with more noise count as much as quiet "
        "ones; solver.weighting: noise tells it better"
    )


def _parameters(before: Fit, after: Fit, member: Member) -> dict[str, tuple[float, float, str]]:
    model, first, key = after.model, 10 * after.model.bodies, member.candidate.key
    joint = key[1]
    out = {
        c.name: (float(after.x[first + k]), float(after.uncertainty.std[first + k]), c.unit)
        for k, c in enumerate(model.coefficients)
        if (c.effect, c.joint) == key
    }
    for value, at, std in zip(model.shape_values, model.shapes, after.shape_std):
        effect = model.terms[value.term][0]
        if effect.name == key[0] and value.joint == joint:
            out[value.name] = (float(at), float(std), value.unit)
    return out


def _finding(
    before: Fit, after: Fit, member: Member, chance: float, step: Step, names, number: int
) -> Finding:
    own = own_joints(member, len(before.joints))
    together = lambda fit: float(
        np.sqrt(np.mean([fit.rms("test")[fit.joints[j]] ** 2 for j in own]))
    )  # noqa: E731
    differences = {d.joint: d for d in comparison.compare(before, after, ("before", "after"))}
    se = float(
        np.sqrt(np.nansum([differences[before.joints[j]].se ** 2 for j in own])) / np.sqrt(len(own))
    )
    joint = _where(member, before)
    others = [(n, j) for n, j, _ in names if (n, j) != (member.candidate.name, joint)]
    words = tuple(n if j in (joint, "*") else f"{n} on {j}" for n, j in others)
    heads = member is step.choice.head
    path = before.experiment.path
    return Finding(
        member,
        joint,
        step.p,
        chance,
        together(before),
        together(after),
        se,
        _parameters(before, after, member),
        words,
        number if heads else None,
        command(path, *spelled(member.candidate, joint)),
    )


def view_after(claims: list[Claim], first: View) -> View:
    """The view of the model with all that is claimed."""
    return claims[-1].step.after if claims else first
