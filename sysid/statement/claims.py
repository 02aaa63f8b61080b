"""The steps that a diagnosis claims, and their findings, as the document has them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..addition import spelled
from ..diagnose.claims import Claim
from ..diagnose.diagnosis import Diagnosis
from ..diagnose.findings import Finding
from ..fit_document import number
from ..vocabulary import describe
from .rivals import or_options
from .words import SURE, Members, named


def claims(found: Diagnosis) -> Iterator[dict]:
    """Of each step that stands: the numbers of its findings, the head first; what may stand in its
    place, and what of it is named: as much as is likelier right than wrong; the held-out error with
    it and all before it in the model."""
    first, of = 0, lambda head: (head.effect, head.joint)
    for claim in found.claims:
        last = first + len(claim.findings)
        yield {
            "findings": list(range(first, last)),
            "set": chances(claim.set),
            "named": [{"effect": e, "joint": j} for e, j in named(of(claim.head), claim.set)],
            "rms_test_after": claim.after.rms("test"),
        }
        first = last


def chances(members: Members) -> list[dict]:
    """What may stand in a step's place, with probabilities."""
    return [{"effect": e, "joint": j, "probability": p} for e, j, p in members]


def confidence_set(claim: Claim) -> Members:
    """The smallest set of explanations, the head first, that holds the truth nine times in ten.
    What is not ruled out beside these stands in the claim's own set."""
    chance = 0.0
    for count, (*_, p) in enumerate(claim.set, 1):
        chance += p
        if chance >= SURE - 1e-9:  # but for rounding
            return claim.set[:count]
    return claim.set


def ties(claim: Claim, f: Finding) -> list[str]:
    """The words of that set that are not a finding of its own: with their joint, where it is
    another."""
    own = (f.effect, f.joint)
    others = ((e, j) for e, j, _ in confidence_set(claim) if (e, j) != own)
    return [e if j in (f.joint, "*") else f"{e} on {j}" for e, j in others]


def finding(f: Finding, claim: Claim, found: Diagnosis) -> dict:
    """An effect that the logs support, as the contract has it and more."""
    before, after = f.rms_before**2, f.rms_after**2
    names = found.fit.joints if f.joint == "*" else [f.joint]
    levels = [found.floors[j].rms for j in names]
    if None in levels:  # no more than the claim leaves
        floor = min(after, float(np.mean([claim.after.rms("test")[j] ** 2 for j in names])))
    else:
        floor = np.mean([level**2 for level in levels])
    misfit = max(before - floor, abs(before - after), 1e-9 * before, 1e-300)
    return {
        "effect": f.effect,
        "joint": f.joint,
        "options": dict(f.candidate.options),
        "options_say": {
            name: f.candidate.effect.options.get(name, "").partition(" (default")[0]
            for name, _ in f.candidate.options
        },
        # the link that holds it, of what a link holds
        "link": getattr(f.candidate.effect, "link", None),
        # other options under which it does as well, for all that these logs tell
        "or_options": or_options(f.candidate, f.forms),
        # as an experiment file spells it
        "adds": dict(zip(("effect", "joints", "options"), spelled(f.candidate, f.joint))),
        "summary": describe(f.candidate.effect)["summary"],
        "probability": f.probability,
        "q_value": f.p,
        "rms_test_before": f.rms_before,
        "rms_test_after": f.rms_after,
        "misfit_removed": float((before - after) / misfit),
        # where no floor is known, what was left of it is not either
        "misfit_known": None not in levels,
        "misfit_removed_se": number(2.0 * f.rms_after * f.fall_se / misfit),
        "parameters": {
            name: {"value": number(v), "std": number(s), "unit": u}
            for name, (v, s, u) in f.parameters.items()
        },
        "size_told": f.size_told,
        "tied_with": ties(claim, f),
        "separate_by": f.candidate.effect.separate_by,
        "command": f.command,
        "joins_as_step": None if f.step is None else f.step + 1,
    }
