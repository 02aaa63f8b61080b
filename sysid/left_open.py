"""Joints of which what is left may come of an effect that another joint may have."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from .model_parameters import ROBOT
from .unexplained import may_be


def left_open(verdicts: Sequence, beyond: Callable, fitted: Callable, worth: float) -> list:
    """Verdicts, of which one that says what may be there is told where a fit with it takes nothing
    of the misfit, and one that says `unknown` is `unresolved` where the rest is nothing that the
    motion predicts once what may be another joint's effect is in the model: it bends bodies that
    both share, or acts on both.

    Args:
        beyond: the Law that stands out of what is left of a joint's number with a Candidate in the
            model, or None. fitted: the share of a joint's misfit on the test logs that goes where a
            Candidate is in a fit. worth: of a square, what a law must predict, and a fit take.
    """
    verdicts = [_in_a_fit(j, one, fitted, worth) for j, one in enumerate(verdicts)]
    asked = sum(one.status not in ("complete", "explained") for one in verdicts)
    mays = {one.may: one.joint for one in verdicts if one.may is not None}

    def again(j: int, one):
        for may, joint in mays.items():
            law = beyond(j, may)
            if law is not None and not law.predicts(asked, worth):
                where = "of the whole robot" if may.joint == ROBOT else f"on {joint}"
                why = (
                    f"what is left may come of {may.name} {where}, which these logs do not tell "
                    "for sure: with it in the model, the motion predicts nothing of the rest"
                )
                return replace(one, status="unresolved", says=why, left=None, may=may)
        return one

    unknown = [one.status == "unknown" and not one.claims for one in verdicts]
    return [again(j, one) if unknown[j] else one for j, one in enumerate(verdicts)]


def _in_a_fit(j: int, one, fitted: Callable, worth: float):
    """The verdict on a joint's number without an effect that may be there and of which a fit makes
    nothing: to add it is no answer."""
    if one.status != "unresolved" or one.may is None or fitted(j, one.may) >= worth:
        return one
    may, tried = (may_be(one.may, in_vain=vain) for vain in (False, True))
    return replace(one, says=one.says.replace(may, tried), may=None)
