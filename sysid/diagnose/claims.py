"""What the search found, as `sysid add` gives it: each effect written into the experiment and
fitted as the user's fit is.

So what a diagnosis states is what comes of it, of several effects what comes of all. The test logs
only refuse: then the next likeliest is fitted, but not beside a claim, where a rest speaks for any;
and of a law with an idle number they may say that a simpler one is as good.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from .. import pipeline
from ..borne_out import beaten, beside, first_borne_out, size_told, tried
from ..carriers import with_tests
from ..estimate import Fit
from ..motion import Motion
from ..refused import Refused, no_claim
from ..simpler import with_simpler
from ..view import as_fitted
from .findings import Finding, finding
from .steps import Step, rejoined

_FITTED, _LIKELY = 3, 0.1  # members of a set that are fitted, and how likely; the rest is named


@dataclass(frozen=True)
class Claim:
    """A step that stands: its findings, the head first; the fits before and after the head joined;
    what may stand in its place with probabilities: [(effect, joint, probability)]; the number of
    the step among all that were searched."""

    step: Step
    findings: tuple[Finding, ...]
    before: Fit
    after: Fit
    set: tuple[tuple[str, str, float], ...]
    number: int = 0

    @property
    def head(self) -> Finding:
        """What is claimed."""
        return self.findings[0]

    def beside_all(self, step: Step, last: Fit) -> Claim:
        """The claim of a step, with the parameters that the fit of all claims gives it."""
        key = self.head.candidate.key
        told = {"parameters": last.parameters_of(*key), "size_told": size_told(last, *key)}
        return replace(self, step=step, findings=(replace(self.head, **told), *self.findings[1:]))


def claimed(
    steps: list[Step], fit: Fit, test: Motion, **known
) -> tuple[list[Claim], list[Refused]]:
    """Fit each step's head, and the best of what is tied with it, on top of what stands before it.

    Args:
        fit: of the experiment as it is. test: logs, low-passed. known: as of `pipeline.refit`.
    """
    stands, refused, last = dict[int, Claim](), dict[int, tuple[Fit, Refused]](), fit
    with_ = lambda how, member: tried(how, member.candidate, last, **known)  # noqa: E731
    heads = [step.candidate.kind for step in steps]
    # what was refused is asked once more with all that stand: the search found it beside them
    for number, step in [*enumerate(steps), *enumerate(steps)]:
        there = {claim.step.candidate.key for claim in stands.values()}
        if number in stands or step.candidate.key in there or last is refused.get(number, [0])[0]:
            continue
        step = replace(step, choice=with_tests(step.choice, last, test))
        first, *other = step.choice.members[:_FITTED]
        free = lambda one: one.key not in there and one.kind not in heads  # noqa: B023, E731
        near = [first, *(m for m in other if free(m[0].candidate))]
        most = 1 if beside(last, step.candidate) else _FITTED
        head, fits, whys = first_borne_out([m for m, _ in near[:most]], last, with_)
        why = whys.get(id(first[0]))
        refused.pop(number, None)
        if head is None:
            refused[number] = last, no_claim(step, why, fit, test)
            continue
        if why:
            refused[~number] = last, Refused(*step.candidate.named(fit.joints), why)
        no_rivals = beaten([m for m, _ in near], head, fits, whys)
        choice = step.choice.headed(head).without(no_rivals)
        may = lambda m: most > 1 and id(m) not in whys and free(m.candidate)  # noqa: B023, E731
        choice = with_simpler(choice, step.before, last, fits, with_, may)
        step = replace(step, choice=choice)
        listed = {id(m) for m, p in near if p >= _LIKELY} | set(fits)
        near = [one for one in step.choice.members if id(one[0]) in listed]
        fits = [fits[id(m)] if id(m) in fits else with_(pipeline.fit_grown, m) for m, _ in near]
        found = [finding(last, a, m, p, step, len(stands)) for a, (m, p) in zip(fits, near)]
        set_ = tuple((*m.candidate.named(fit.joints), p) for m, p in step.choice.members)
        stands[number] = Claim(step, tuple(found), last, fits[0], set_, number)
        last = fits[0]
    claims, own = list(stands.values()), [claim.step for claim in stands.values()]
    if any(one.choice.head is not other.choice.head for one, other in zip(own, steps)):
        own = rejoined(steps[0].before, own)  # without what is refused
    own[-1:] = [replace(step, after=as_fitted(step.after, last)) for step in own[-1:]]
    claims = [claim.beside_all(step, last) for claim, step in zip(claims, own)]
    there = {(claim.head.effect, claim.head.joint) for claim in claims}
    return claims, [own for _, own in refused.values() if (own.effect, own.joint) not in there]
