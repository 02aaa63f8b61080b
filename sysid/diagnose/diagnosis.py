"""A fitted experiment -> where it fails, what is missing, and what its logs could have shown.

The whole loop on one page:

    fit (given, or made)
    training logs -> view: both sides under one low-pass, events and standstill left out
    view -> steps: every candidate asked at once, what is there and worth having joins, and again
    steps -> claims: each fitted as `sysid add` fits it, whose parameters and command are told
    test logs, opened once -> errors, where the model fails, laws of no catalogue that hold there
    claims + noise floors + what the motion still predicts -> the verdict on each joint,
        again without claims that take less than half of all that they are claimed of
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import held_bodies, loads, pipeline, thinning
from ..borne_out import undecided
from ..candidates import candidates
from ..estimate import Fit
from ..failures import Failure, HeldOut, failures, fallen
from ..left_open import left_open
from ..lowpass import lowpassed
from ..misread import misread, unasked
from ..noise import NoiseFloor, floors_of_fit
from ..refused import Refused
from ..shown import ShownDiagnosis
from ..specs import Experiment
from ..suspected import suspected
from ..transfer import transfers
from ..unexplained import no_names, notices, otherwise
from ..view import View, first_view, too_short
from ..warned import noticed
from ..what_is_left import Left
from . import select
from .claims import Claim, claimed
from .detectable import Detectable, detectable
from .findings import Finding
from .refits import refitted
from .steps import rejoined
from .verdict import Verdict, verdicts


@dataclass(frozen=True, repr=False)
class Diagnosis(ShownDiagnosis):
    """Everything that `sysid diagnose` says. view: the model before all claims; first, last: before
    and after them, on the test logs; notices: what to know beside it."""

    fit: Fit
    floors: dict[str, NoiseFloor]
    claims: tuple[Claim, ...]
    verdict: tuple[Verdict, ...]
    detectable: tuple[Detectable, ...]
    failures: tuple[Failure, ...]
    events: tuple
    view: View
    first: HeldOut
    last: HeldOut
    refused: tuple[Refused, ...] = ()
    notices: tuple[str, ...] = ()

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of all claims, each head followed by what is tied with it."""
        return tuple(finding for claim in self.claims for finding in claim.findings)


def diagnose(
    experiment: Experiment,
    *,
    fit: Fit | None = None,
    level: float = select.LEVEL,
    progress: pipeline.Progress | None = None,
) -> Diagnosis:
    """Question an experiment's model.

    Args:
        fit: where it is at hand. level: family-wise, of accusing anything where nothing is.

    Raises SysidError: bad input, or logs too short to question.
    """
    tell = progress or (lambda stage, share: None)
    experiment = fit.experiment if fit else pipeline.started(experiment)
    measured, whole = thinning.read(experiment)
    fit = fit or pipeline.fit(experiment, progress=progress, measured=whole)
    with noticed():
        view = first_view(fit.experiment, fit, *measured.parts)
        extra = suspected(fit.experiment, view)
        how = {"level": level, "tell": tell, "most": 0 if (wrong := misread(fit)) else select.STEPS}
        steps, asked, then_asked, open_ = select.search(view, extra, **how)
        if (test := lowpassed(measured.test, fit.joints, view.cutoff)) is None:
            raise too_short()
        known = {"filters": fit.filters, "progress": tell, "measured": whole}
        first = HeldOut(view.settled, test)

        def judged(steps, before):
            claims, more = claimed(steps, fit, test, **known)
            there = {(claim.head.effect, claim.head.joint) for claim in claims}
            refused = [r for r in [*before, *more] if (r.effect, r.joint) not in there]
            after, last = (claims[-1].step.after, claims[-1].after) if claims else (view, fit)
            then = HeldOut(after.settled, test)
            found, weighed = floors_of_fit(experiment, last, after.model, after.x, measured.parts)
            answers = (then_asked, asked), measured, refitted, known
            left = Left(after, last, then, found, *answers)
            more = refused, transfers(last, view.cutoff), weighed, left.law, then_asked.near
            rest = left.few, left.beyond, fallen(first, then), otherwise(last, found, test.still)
            named = verdicts(fit, claims, after.unknown, found, *more, *rest)
            if small := no_names(claims, named):
                kept = rejoined(view, [s for k, s in enumerate(steps) if k not in small])
                return judged(kept, [*before, *small.values()])
            said = unasked(named) if wrong else left_open(named, left, select.WORTH)
            return claims, refused, said, after, last, then, found

        undone = [undecided(choice, fit) for choice in open_[-1:]]
        claims, refused, said, after, last, then, found = judged(steps, undone)
        levels = np.array([f.rms or e for f, e in zip(found, last.rms("test").values())])
        where = failures(first, fit.predictions["test"].thinned(thinning.MOST), levels, view)
        could = detectable(view, asked, candidates(view.model, extra))
        events, part = (*view.motion.events, *test.events), () if whole else measured.notices
        told = tuple(claims), tuple(said), tuple(could), tuple(where), events, view, first, then
        held = held_bodies.told(fit, last, found, {c.head.joint for c in claims}, known)
        beside = (*notices(claims, refused, fit), *loads.told(after))
        say = tuple(refused), (*wrong, *part, *held, *beside)
        return Diagnosis(fit, dict(zip(fit.joints, found)), *told, *say)
