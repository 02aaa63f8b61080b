"""Whether fits bear out an effect that a search found."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from . import blocks, comparison, pipeline
from .addition import grown, separating, spelled, told_by_motion, typed
from .candidates import Candidate
from .effect import NotFinite, SensorEffect
from .estimate import Fit
from .model_parameters import ROBOT
from .plain_model import PLAIN
from .plausible import centred
from .refused import Refused
from .unexplained import changed, explains

CLEAR = 2.0  # standard deviations
_LIKELY = 0.05  # less is not listed
_WORTH = 1.5e-2  # of an error: what is worth having, three per cent of its square (`select`)
_VISIBLE = 0.1  # of an error: what falls by less and has no size of its own is no name
NOTHING = 5e-3  # of an error: a hundredth of its square, the least that is told in per cent


def tried(how: Callable, candidate: Candidate, last: Fit, **known):
    """What `how`, `pipeline.refit` or another of its kind, makes of a fit's experiment with a
    candidate, written as `sysid add` writes it.

    Args:
        known: as of `how`.
    """
    name, joints, options = spelled(candidate, candidate.where(last.joints))
    spec = grown(last.experiment, name, joints, options, every=last.joints)
    return how(spec, last, **known)


def misfit_taken(last: Fit, j: int, floor, known: dict, candidate: Candidate) -> float:
    """The share of joint j's misfit on the test logs that goes where a candidate is in a fit; none
    where it is no finite number there.

    Args:
        floor: its NoiseFloor. known: as of `pipeline.fit_grown`.
    """
    try:
        both = last, tried(pipeline.fit_grown, candidate, last, **known)
    except NotFinite:
        return 0.0
    return explains(*(one.rms("test")[last.joints[j]] for one in both), floor.rms or 0.0)


def doubted(
    before: Fit, after: Fit, without: Callable[[], Fit], told: Fit, candidate: Candidate
) -> str | None:
    """Why fits do not bear out a candidate under either prior, None where they do: one that was
    chosen without it may have bodies make up for it, so that they hold it back as it joins.

    Args:
        without: fits the model of the fit before under the prior of told, that of `sysid add`; as
            before and after are under that of the fit before.
    """
    why = in_doubt(before, after, told, candidate)
    if why is None or told is after or in_doubt(without(), told, told, candidate):
        return why
    own = None if candidate.joint == ROBOT else list(candidate.judged_by(before.joints))
    risen = comparison.rises(before, told, own) or comparison.spoiled(before, (after, told), own)
    return why if risen else None


def first_borne_out(near: Sequence, last: Fit, with_: Callable):
    """The first that fits bear out, of members of a set that logs cannot tell apart; the fits, and
    why they do not bear one out, by the id of who is in them.

    One whose size its fit does not tell gives way to another whose size is told and that leaves no
    more of the test logs: an offset of five degrees was play of 0.08 +- 0.06 rad.

    Args:
        near: members, the likeliest first. with_: fits the model of `last` with one.
    """
    fits, whys, found = {}, {}, None
    for member in near:
        after, *others = with_(pipeline.refit, member)  # and under one prior, the last one's or its
        fits[id(member)] = after
        if why := doubted(last, *others, after, member.candidate):
            whys[id(member)] = why
            continue
        told = size_told(after, *member.candidate.key)
        if found is None:
            found = member
        elif told and comparison.together(fits[id(found)], after).delta_rms <= 0.0:
            whys[id(found)] = (
                f"its size is nothing beside its deviation, {member.candidate.name}'s is"
            )
            found = member
        if told:
            break
    return found, fits, whys


def beaten(near: Sequence, head, fits: dict, whys: dict) -> set:
    """The keys of members that fits do not bear out and that leave clearly more of the test logs than
    the head: they are no rivals of it. Of those that read torque late none is: the noise of angles
    bends their fits."""
    out = set()
    for member in near:
        if id(member) in whys and id(member) in fits and member.candidate.late is None:
            risen = comparison.together(fits[id(head)], fits[id(member)])
            clear = risen.delta_rms > max(CLEAR * risen.se, _WORTH)
            out |= {member.candidate.key} if clear else set()
    return out


def beside(fit: Fit, candidate: Candidate) -> bool:
    """Whether a fit has an effect on a candidate's joint beyond what every joint has: a law that is
    not quite the catalogue's leaves a rest, and what the training logs have of it the test logs must
    have as well."""
    own = (effect.name for effect, joints in fit.model.terms if candidate.joint in joints)
    return any(name not in (*PLAIN, candidate.name) for name in own)


def in_doubt(before: Fit, after: Fit, told: Fit, candidate: Candidate) -> str | None:
    """Why fits do not bear out a candidate, None where they do. Both are fits with it: after under
    the prior of the one before, told as `sysid add` gives it."""
    own, whole = candidate.judged_by(before.joints), candidate.joint == ROBOT
    if whole:  # what held bodies against its lack may hold them against it
        after = min((after, told), key=lambda one: comparison.together(before, one).delta_rms)
    if "logs" in dict(candidate.options) and _is_zero(before, after, own, whole):
        return "another zero of each log's torque leaves less"
    if none := at_zero(told, *candidate.key):
        more = ", and what is left of it is another effect" * (
            len(candidate.effect.coefficients()) > 1
        )
        return f"its {none} is at its bound of zero{more}"
    fell = any(after.rms("train")[joint] < before.rms("train")[joint] for joint in own)
    if whole:
        change, unit, still = comparison.together(before, after), 1.0, True
        rise = f"{changed(change.delta_rms)} over all joints"
    else:
        change, shown = (comparison.of_joint(before, one, own[0]) for one in (after, told))
        unit = before.rms("test")[own[0]]
        rise = changed(change.delta_rms / max(unit, 1e-300))
        still = any(-d.delta_rms < CLEAR * d.se for d in (change, shown))
        # what reads a torque late makes torque of the angles' noise, in the fit's own error too
        fell |= candidate.late is not None and all(-d.delta_rms > d.se for d in (change, shown))
    # a fit that weighs all joints alike may trade a quiet one's own error for what a loud one gains
    if not fell and still:
        return "the fit's own error does not fall with it"
    little = change.delta_rms > -_WORTH * unit
    more = beside(before, candidate)
    # where joints count by their noise, deviations of quiet ones are no larger than they are
    least = _WORTH if told.weights is None else _VISIBLE
    hardly = change.delta_rms > -least * unit
    if not whole and (still or hardly or more) and not size_told(told, *candidate.key):
        falls = f"and the test error falls by less than {100.0 * least:.2g} %"
        falls = falls if hardly else "and another effect is on that joint already"
        falls = "nor the fall of the test error beside its own" if still else falls
        return f"its size is nothing beside its deviation, {falls}"
    # what moves a joint may show in the torque of those that it carries, or that carry it; and a
    # torque that is read wrongly is made up for by bodies, which those that carry them bear
    read = isinstance(candidate.effect, SensorEffect) and change.delta_rms < 0.0
    wide = len(candidate.touches(2)) > 1 or (read and size_told(told, *candidate.key))
    wide = wide and comparison.falls(before, after, NOTHING)
    unsure = little and change.delta_rms > -change.se and more
    if (change.delta_rms > -NOTHING * unit or unsure) and not wide:
        falls = "hardly falls" if change.delta_rms < 0.0 else "does not fall"
        if unsure and change.delta_rms <= -NOTHING * unit:
            falls = "falls by less than its standard error, beside what is on that joint already"
        return f"with it the error on the test logs {falls} ({rise})"
    if not whole and (other := comparison.spoiled(before, (after, told), own)):
        rise = changed(other[0].delta_rms / before.rms("test")[other[0].joint])
        return f"with it the test error of {other[0].joint} rises ({rise}) by more than any joint's falls"
    # what is told is the error of the other fit: where it rises, nobody sees an error fall
    if whole:
        risen = comparison.rises(before, told, None)
    else:
        risen = shown.delta_rms > 0.0 and not (wide and comparison.falls(before, told, NOTHING))
    if risen:
        return "as `sysid add` fits it, the error on the test logs rises"
    # as the fit weighs them, as it trades what a quiet joint loses for what a loud one gains; and
    # each by its own error, as little of a loud joint outweighs all of a quiet one's; and what held
    # bodies against its lack may hold them against it
    ways = [(one, weighed) for one in (after, told) for weighed in (True, False)]
    paid = (comparison.together(before, one, weighed=weighed) for one, weighed in ways)
    if all(one.delta_rms > one.se for one in paid):
        return "with it the test error of all joints together rises, whether as the fit weighs them or each by its own"
    return None


def _is_zero(before: Fit, after: Fit, own: Sequence[str], whole: bool) -> bool:
    """Whether a torque's zero that was set anew in each log leaves clearly less of the test logs than
    what is in some of them does, and this takes nothing of what the zeros leave."""

    def change(first: Fit, second: Fit):
        if whole:
            return [comparison.together(first, second)]
        return [comparison.of_joint(first, second, joint) for joint in own]

    zero = centred(before)
    less = all(d.delta_rms > d.se for d in change(zero, after))
    return less and not any(d.delta_rms < -d.se for d in change(zero, centred(after)))


def size_told(fit: Fit, effect: str, joint: int) -> bool:
    """Whether the parameters of an effect on a joint's number (-1: of the robot) that say how large
    it is are together farther from where it does nothing than their deviations can make. Beyond
    which torque a signal bends, or how fast warmth comes, is no size."""
    model, count, first = fit.model, fit.compressed.blocks, 10 * fit.model.bodies
    own = [k for k, c in enumerate(model.coefficients) if (c.effect, c.joint) == (effect, joint)]
    own = [k for k in own if np.isfinite(fit.uncertainty.std[first + k])]
    known = fit.uncertainty.covariance[np.ix_(at := first + np.array(own, dtype=int), at)]
    if blocks.clear(fit.coefficients[own], known, count):
        return True
    whose = [(model.terms[v.term][0].name, v.joint) for v in model.shape_values]
    values = [
        (k, v)
        for k, v in enumerate(model.shape_values)
        if whose[k] == (effect, joint)
        and v.shape.start is not None
        and np.isfinite(fit.shape_std[k])
    ]
    away = np.array([model.shapes[k] - v.shape.start for k, v in values])
    known = fit.shape_covariance[np.ix_(at := [k for k, _ in values], at)]
    return blocks.clear(away, known, count)


def at_zero(fit: Fit, effect: str, joint: int) -> str:
    """The coefficients, in words, of an effect on a joint's number that say how large it is and may
    not be negative, where all of them are held at zero in a fit: a spring without stiffness."""
    model, held = fit.model, fit.certificate.at_zero
    own = [
        k
        for k, c in enumerate(model.coefficients)
        if (c.effect, c.joint) == (effect, joint) and c.positive
    ]
    names = [model.coefficients[k].name.rpartition(".")[2] for k in own if k in held]
    return " and ".join(names) if own and len(names) == len(own) else ""


def undecided(choice, fit: Fit) -> Refused:
    """What is there and cannot be told from effects on other joints, first the first: of a choice
    the members with their probabilities."""
    likely = [(*one.candidate.named(fit.joints), chance) for one, chance in choice.members]
    names = [
        f"{one} on {at} ({100 * chance:.0f} %)" for one, at, chance in likely if chance >= _LIKELY
    ]
    told = told_by_motion([(one, at) for one, at, chance in likely if chance >= _LIKELY])
    why = f"something is there, and these logs cannot tell which: {', '.join(names)}"
    if told:
        line = separating(str(typed(fit.experiment.path)), told)
        why += f"; a motion that tells is designed by `{line}`"
    return Refused(*likely[0][:2], why)
