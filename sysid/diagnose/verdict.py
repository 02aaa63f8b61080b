"""The verdict on each joint: complete, missing, explained, unknown or unresolved."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .. import unexplained
from ..candidates import Candidate
from ..estimate import Fit
from ..flexible import Law, Unknown
from ..noise import DOUBT, as_of_test
from ..plausible import Reason
from ..refused import in_vain
from ..transfer import Transfer, quieter
from ..unexplained import by_weights, cause, explains, loudest, may_be_noise, not_all
from ..view import taken_where_held
from .ask import HALF
from .claims import Claim
from .select import LEVEL, WORTH

_LEFT, _PREDICTED, _FALLS = 0.25, 0.1, (1.0 - WORTH) ** 0.5  # of what effects took; of an error


@dataclass(frozen=True)
class Verdict:
    """One joint's verdict.

    status: complete (nothing is left above the noise), missing (`claims`: what is claimed, first
    the first), explained (by the claims of other joints' equations), unknown (of what is left the
    motion predicts a tenth of what claims took, or these take less than 80 % of all), unresolved
    (error stands above the floor, or the floor is not known, and nothing says why). explained: what
    claims take of the joint's misfit on the test logs, or NaN. left: what functions of the motion
    predict of the rest, or None. says: why something is left. may: the effect that may be it. even:
    whether weights make it. carries: how test logs err more. reason: what else than a law it is.
    follows: the Law that the strength of the rest follows. small: whether claims take less than
    half of the error above the noise.
    """

    joint: str
    status: str
    claims: tuple[Claim, ...] = ()
    explained: float = float("nan")
    left: Unknown | None = None
    says: str = ""
    may: Candidate | None = None
    even: bool = False
    carries: Transfer | None = None
    reason: Reason | None = None
    follows: Law | None = None
    small: bool = False


def verdicts(
    fit: Fit,
    claims: Sequence[Claim],
    left: Sequence[Unknown],
    floors: Sequence,
    refused: Sequence = (),
    carried: Sequence[Transfer] = (),
    weighed: dict[str, float] | None = None,
    law: Callable[[int], Law] | None = None,
    near: Callable[[int, float, bool], tuple[Candidate, float] | None] = lambda *_: None,
    few: Callable[[int, float, bool], tuple[Candidate, float] | None] = lambda *_: None,
    beyond: Callable[[int, Candidate], Law | None] | None = None,
    took: Sequence[float] | None = None,
    means: Mapping[str, Reason] | tuple = (),
) -> list[Verdict]:
    """The verdict on every joint.

    Args:
        fit: of the experiment as it is. left: what functions of the motion predict with all claims.
            floors: of each joint's noise. carried: whether the model with all claims carries over.
            weighed: {joint: RMS where each counts by its noise}. law: the function that stands out
            most of what is left of a joint; beyond: the same with what `near`, or by test logs
            alone `few`, says may be it in the model. took: what all claims take of each joint's
            square on the test logs, low-passed. means: {joint: why} where no law may be it.
    """
    last = claims[-1].after if claims else fit
    trained = [as_of_test(f.rms("train"), floors) for f in (fit, last)]
    firsts, errors = zip(trained, (quieter(f.rms("test"), carried) for f in (fit, last)))
    out, weighed, most = [], weighed or {}, {j: max(e[j] for e in errors) for j in fit.joints}
    by_joint = list(zip(fit.joints, floors))
    reaches = [floor.reached(most[joint]) for joint, floor in by_joint]
    evens = [by_weights(last, joint, floor.rms, weighed) for joint, floor in by_joint]
    louder = loudest(errors[1], floors, [not (at or even) for at, even in zip(reaches, evens)])
    # an error that is no more than noise, however joints are weighed, or than its drift, lacks none
    asked = [not f.within(min(most[j], weighed.get(j, np.inf))) for j, f in by_joint]
    asked = [own and not (at and one.drifts) for own, at, one in zip(asked, reaches, left)]
    for j, joint in enumerate(fit.joints):
        taking = [c for c in claims if c.head.joint == joint or c.step.shares[j] >= WORTH]
        pairs = [tuple(one[joint] for one in part) for part in zip(firsts, errors)]
        (first, then), both = pairs[1], [after for _, after in pairs]
        # what does not lower the joint's error on the test logs is no name for it
        least = {joint: first, "*": _FALLS * first}
        own = tuple(c for c in taking if then < least.get(c.head.joint, 0.0))
        others = tuple(c for c in taking if c.head.joint not in (joint, "*"))
        low, noise = (floors[j].rms or v or 0.0 for v in (floors[j].low, floors[j].about))
        explained = explains(first, then, low) if claims else float("nan")
        # who leaves more than noise, which no log has more of than another's error, is no name
        whole = (1.0 + _LEFT) * explains(first, then, min(*both, noise)) >= 1.0
        whole |= may_be_noise(first, both, floors[j])
        # where a floor is known, other weights say how much of the rest loud joints make
        whole |= took is not None and floors[j].rms is None and (1.0 + _LEFT) * took[j] >= 1.0
        seen, among = left[j], sum(asked)
        if law and asked[j] and then > 0.0 and not ((one := law(j)).inertial and reaches[j]):
            seen = seen.with_law(one, among, WORTH)  # noise of angles at a floor is no law
        remains = seen if asked[j] and seen.predictable(among, WORTH) else None
        part = remains.share if remains else 1.0
        looks = near(j, part * seen.total, bool(remains))
        looks = looks or in_vain(refused, fit.joints, j, HALF * part)
        stays = bool(remains or not (reaches[j] and first > 0.0))  # else nothing asks what it is
        stays_open = stays and asked[j] and not own
        looks = looks or (stays_open and few(j, HALF * part, not remains)) or None
        # of whichever logs they explain less of: where these do not carry over, another law may
        held = taken_where_held(own[0].step.before, own[-1].step.after)[j] if own else 0.0
        taken = max(min(max(sum(c.step.shares[j] for c in own or others), held), explained), 0.0)
        little = remains is None or remains.share * max(1.0 - taken, 0.0) <= _PREDICTED * taken
        further = beyond(j, looks[0]) if looks and remains and beyond and not own else None
        further = further if further and further.predicts(among, WORTH) else None
        done = others and not own and remains and whole and little
        fell = others and first > (1.0 + DOUBT) * (floors[j].rms or 0.0) and then < _FALLS * first
        small = False
        if own and (whole or evens[j]) and little:
            told = ("missing", own, explained, remains)
            small = unexplained.a_part(*pairs, floors[j]) and not evens[j]
        elif not done and (own or (remains and (further or not looks) and joint not in means)):
            why = not_all(looks[0].name, further.share) if further else ""
            why = why if remains else cause(both, floors[j])
            told = ("unknown", own or others, explained, remains, why)
        elif not done and stays:
            without = weighed[joint] if evens[j] else None
            effect, p = looks or (None, 1.0)
            may = effect if p > LEVEL else None  # what stands above the level was fitted, in vain
            mean = dict(means).get(joint) if then > 0.0 and not evens[j] else None
            mean = mean if mean and (mean.settles or (remains and not looks)) else None
            if then > 0.0:
                mean = mean or unexplained.by_filter(both, floors[j], (effect, without))
            why = mean.says if mean else cause(both, floors[j], effect, may, without, louder)
            may, remains = (None, None) if mean and mean.settles else (may, remains)
            why += "".join({r.effect: f"; {r.told}" for r in refused if r.joint == joint}.values())
            told = ("unresolved", others, explained, remains, why, may, evens[j], None, mean)
        elif not claims or (floors[j].reached(first) and not (done or fell)):
            told = ("complete",)
        else:
            who = others or (max(claims, key=lambda c, j=j: c.step.shares[j]),)
            told = ("explained", who, explained)
        out.append(Verdict(joint, *told, small=small))
    said = {found.joint: found for found in carried if found.says}
    settled = [o.reason is not None and o.reason.settles for o in out]  # it is not carried anywhere
    return [o if s else replace(o, carries=said.get(o.joint)) for o, s in zip(out, settled)]
