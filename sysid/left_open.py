"""Joints of which nobody can say what is left: what it may come of, or what its strength follows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from .model_parameters import ROBOT
from .unexplained import may_be

_CLEAR = 1e-5  # slow noise of 20 s has few turns: the tail of its strength is told too thin


def left_open(verdicts: Sequence, left, worth: float) -> list:
    """Verdicts, of which one that says what may be there is told where a fit with it takes nothing
    of the misfit, and one that says `unknown` is `unresolved` where the rest is nothing that the
    motion predicts once what may be another joint's effect is in the model: it bends bodies that
    both share, or acts on both. Of one that stays `unresolved` it is told what the strength of the
    rest follows.

    Args:
        left: what is Left of joints. worth: of a square, what a law must predict, and a fit take.
    """
    verdicts = [_in_a_fit(j, one, left.fitted, worth) for j, one in enumerate(verdicts)]
    asked = sum(one.status not in ("complete", "explained") for one in verdicts)
    mays = {one.may: one.joint for one in verdicts if one.may is not None}

    def again(j: int, one):
        for may, joint in mays.items():
            law = left.beyond(j, may)
            if law is not None and not law.predicts(asked, worth):
                where = "of the whole robot" if may.joint == ROBOT else f"on {joint}"
                why = (
                    f"what is left may come of {may.name} {where}, which these logs do not tell "
                    "for sure: with it in the model, the motion predicts nothing of the rest"
                )
                return replace(one, status="unresolved", says=why, left=None, may=may)
        return one

    unknown = [one.status == "unknown" and not one.claims for one in verdicts]
    out = [again(j, one) if unknown[j] else one for j, one in enumerate(verdicts)]
    out = [_but_for_a_moment(one, left) if _open(one) else one for one in out]
    return [_with_strength(j, one, left, worth) for j, one in enumerate(out)]


def _open(one) -> bool:
    """Whether nobody can say what a joint's rest is."""
    return one.status == "unresolved" and not (one.may or one.even or one.reason)


def _but_for_a_moment(one, left):
    """The verdict on a joint, with where it is not at its noise, if that is a moment alone."""
    said = None if one.left else left.moments.get(one.joint)
    return replace(one, says=said.says, reason=said) if said else one


def _with_strength(j: int, one, left, worth: float):
    """The verdict on a joint's number, with what the strength of the rest follows where nobody can
    say what it is: what most laws do, and noise may."""
    if not _open(one):
        return one
    law = left.strength(j)
    clear = law is not None and law.chance < _CLEAR and law.share > worth
    # accelerations are what filters smear
    return replace(one, follows=law) if clear and not law.inertial else one


def _in_a_fit(j: int, one, fitted: Callable, worth: float):
    """The verdict on a joint's number without an effect that may be there and of which a fit makes
    nothing: to add it is no answer."""
    if one.status != "unresolved" or one.may is None or fitted(j, one.may) >= worth:
        return one
    may, tried = (may_be(one.may, in_vain=vain) for vain in (False, True))
    return replace(one, says=one.says.replace(may, tried), may=None)
