"""Joints of which what is left may come of an effect that another joint may have."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from .model_parameters import ROBOT


def left_open(verdicts: Sequence, beyond: Callable, worth: float) -> list:
    """Verdicts, of which one that says `unknown` is `unresolved` where the rest is nothing that the
    motion predicts once what may be another joint's effect is in the model: it bends bodies that
    both share, or acts on both.

    Args:
        beyond: the Law that stands out of what is left of a joint's number with a Candidate in the
            model, or None. worth: of a square, what a law must predict.
    """
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
