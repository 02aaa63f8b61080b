"""Why error that stands above a noise floor is left without a name, and a name without a size, in
words."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from .addition import one_in_motion
from .cancelling import cancelling
from .candidates import Candidate
from .effect import NotFinite
from .estimate import Fit
from .failures import HeldOut, fallen
from .given_shapes import at_edges
from .mean_by_log import MOST, by_log
from .one_clock import clocks_anew
from .plausible import AT_REST, Reason, stands
from .pressed import pressed
from .refused import PART, Refused
from .too_narrow import noise_as_law

_FITTED = 0.1  # of what is left on test logs: a fit is made to see whether it takes more there
WEIGHED = "`weighting: noise` under `solver:` in the experiment file"


def of_few_blocks(
    groups,
    refitted: Callable,
    without: HeldOut,
    j: int,
    least: float,
    fitted: Callable[[Candidate], float] = lambda _: 0.0,
    *,
    soft: bool = True,
):
    """The Candidate that takes most of joint j's squared residual on the test logs, under the
    low-pass, a tenth at least and at least such a share, of those that training logs show in too few
    places to ask them, or, where `soft`, of which slopes say little, as a link stands apart from its
    motor by them; with a p-value of one, as test logs may not choose. None where there is none.

    Args:
        groups: of the joint. refitted: makes a Member, or None, of one. without: the model without
            them. fitted: the share of the joint's misfit that goes as a fit has it, about reversals
            too, where a low-pass shows none: half of it is enough.
    """
    few = [g for g in groups if g.signed and (not g.testable or (soft and g.candidate.swings))]
    few = {g.candidate.kind: g for g in sorted(few, key=lambda g: g.taken)}.values()
    shares, swing = {}, 0.0
    for group in sorted(few, key=lambda g: g.testable and g.candidate.blows):
        # play lets a link lag as a soft gear does, and is sought for ten times as long
        if group.testable and group.candidate.blows and not swing > _FITTED:
            continue
        try:
            if member := refitted(group):
                then = HeldOut(member.view.settled, without.test)
                shares[member.candidate] = fallen(without, then)[j]
                if group.candidate.swings:
                    swing = max(swing, shares[member.candidate])
        except NotFinite:  # on the test motion
            continue
    best = max(shares, key=shares.get, default=None)
    # less than a tenth may fall by chance, where one of several is picked
    if best and shares[best] > _FITTED and (shares[best] >= least or fitted(best) >= MOST):
        return best, 1.0
    return None


def may_be(candidate: Candidate, *, in_vain: bool) -> str:
    """What may be left of a joint, in words. in_vain: no fit with it bore that out."""
    tried = ", though no fit with it bore that out," if in_vain else ""
    return (
        f"what is left may be {candidate.name}{tried} or a law that the catalogue does not have: "
        "these logs do not tell"
    )


def cause(
    errors: tuple[float, float],
    floor,
    looks=None,
    may=None,
    weighed: float | None = None,
    louder: str = "",
) -> str:
    """Why a joint is unresolved.

    Args:
        errors: on the training logs and on the test logs. floor: its NoiseFloor. looks: the
            Candidate that may be what is left; may: the same where nobody fitted it. weighed: the
            error where each joint counts by its noise, where that makes most of the difference.
            louder: the joint whose misfit is the greatest in torque.
    """
    error = errors[1]
    if not error > 0.0:
        return (
            "none of its rows on the test logs counts: its torque is unused or was not logged, it "
            "stands still, or it is disturbed"
        )
    if looks:
        return may_be(looks, in_vain=not may)
    if floor.rms is None:
        return (
            f"its noise floor is not known ({floor.detail}), so nobody can say what error is left "
            "above it"
        )
    if weighed is not None:
        whose = f"the greater one of {louder}" if louder else "that of a noisier joint"
        return (
            f"its error is {_times(error, floor)}: in this fit the errors of all joints count "
            f"alike, and {whose} bends the bodies that they share; with {WEIGHED}, it would be "
            f"{_times(weighed, floor)}"
        )
    if floor.reached(errors[0]):
        return (
            "the training logs are explained and the test logs are not: the model does not carry "
            "over to them, or their noise is louder, as that of a coarse encoder in slow motion"
        )
    where = ""
    if floor.reached(error):
        error, where = errors[0], " on the training logs"
    return (
        f"its error{where} is {_times(error, floor)}, and nothing in the motion of these logs "
        "predicts the rest"
    )


def otherwise(fit: Fit, floors, still: Sequence[str] = ()) -> dict[str, Reason]:
    """{joint: why} of joints of which something else than a law may be what the motion predicts: a
    filter that is too narrow for the angles, what `by_log` says, rest, and what holds them there."""
    # a low-pass spreads the little that a joint creeps, as a controller holds it
    still = list(dict.fromkeys([*still, *fit.predictions["test"].still]))
    hold_out = f"{AT_REST}; hold out a log in which it moves, or leave it out with robot.lock"
    trained = lambda joint: floors[fit.joints.index(joint)].reached(fit.rms("train")[joint])  # noqa: E731
    rests = {
        joint: Reason(hold_out, settles=True)
        for joint in still
        if joint in stands(fit) or trained(joint)
    }
    narrow = {joint: Reason(why) for joint, why in noise_as_law(fit.filters).items()}
    return rests | narrow | by_log(fit, floors, still) | pressed(fit)


def smeared(errors: Sequence[float], floor) -> bool:
    """Whether most of what stands above a NoiseFloor, on the training logs and on the test logs, goes
    where angles are smoothed over half of their window: accelerations that jump are smeared, and
    nothing is missing."""
    if floor.rms is None or floor.halved is None:
        return False
    parts = [both for both in zip(errors, floor.halved[1:]) if not floor.reached(both[0])]
    gone = (e**2 - half**2 > MOST * (e**2 - floor.rms**2) for e, half in parts)
    return bool(parts) and all(gone)


def by_filter(errors: Sequence[float], floor, but=()) -> Reason | None:
    """What is said of a joint whose error is `smeared`, unless there is more to say; None of any
    other. No other log is a cure."""
    if any(one is not None for one in but) or not smeared(errors, floor):
        return None
    half, *left = floor.halved
    worst = int(np.argmax(errors))
    return Reason(
        f"its error is {_times(errors[worst], floor)}, and that angles are smoothed over "
        f"{2.0 * half:g} s makes most of that; with `window: {half:g}` under `preprocess:` in "
        f"the experiment file it would be {_times(left[worst], floor)}"
    )


def not_all(effect: str, share: float) -> str:
    """What an effect that may be there is beside a law that stands out with it in the model too,
    and predicts such a share of what it leaves."""
    return (
        f"{effect} may be part of what is left, but not all: with {effect} in the model, the "
        f"motion still predicts {100 * share:.0f} % of the rest"
    )


def _times(error: float, floor) -> str:
    times = error / max(floor.rms, 1e-300)
    return "at the noise floor" if times < 1.05 else f"{times:.2g} times the noise floor"


def explains(before: float, after: float, floor: float) -> float:
    """The share of a misfit that goes, of errors and the noise in both; NaN where there is none."""
    misfit = before**2 - floor**2
    return (before**2 - after**2) / misfit if misfit > 0 else float("nan")


def may_be_noise(before: float, after: Sequence[float], floor) -> bool:
    """Whether what an effect leaves may be noise, by a NoiseFloor that is known, or what a filter
    smears: it is at the floor on the training logs; or most of its square is noise, and there is no
    more above it than the effect took, or no more than the floor's doubt.

    Args:
        before: the error on the test logs without it. after: with it, on the training logs and on
            the test logs.
    """
    if floor.reached(after[0]) or smeared(after, floor):
        return True
    if floor.rms is None or MOST * after[1] ** 2 > floor.rms**2:
        return False
    return explains(before, after[1], floor.rms) >= MOST or floor.reached(after[1])


def a_part(train: Sequence[float], test: Sequence[float], floor) -> bool:
    """Whether an effect takes less than half of what stands above a NoiseFloor, on the training logs
    and, beyond its standard error, on the test logs: what it resembles may be there in its place.

    Args:
        train, test: errors (without it, with it).
    """
    if floor.rms is None or not explains(*train, floor.rms) < MOST:
        return False
    if smeared((train[1], test[1]), floor):  # the rest is the filter's
        return False
    return explains(*test, floor.rms + floor.std) < MOST


def no_names(claims: Sequence, verdicts: Sequence) -> dict[int, Refused]:
    """By the numbers of their steps, claims that are `a_part` of all that they are claimed of: of one
    joint, or, of the whole robot, of every joint that they are a name, or a part of one, for."""
    small = {one.joint for one in verdicts if one.small}
    others = (one for one in verdicts if not one.small and one.status in ("missing", "unknown"))
    stand = [id(claim) for one in others for claim in one.claims]

    def goes(claim) -> bool:
        joint = claim.head.joint
        return bool(small) and (joint in small or (joint == "*" and id(claim) not in stand))

    return {c.number: Refused(c.head.effect, c.head.joint, PART) for c in claims if goes(c)}


def by_weights(fit, joint: str, floor: float | None, weighed: dict[str, float]) -> bool:
    """Whether most of what stands above a joint's floor is how a fit weighs its joints.

    Args:
        weighed: {joint: RMS where each counts by its noise}.
    """
    if floor is None or fit.weights is not None:
        return False
    square = fit.rms("test")[joint] ** 2
    return square - weighed.get(joint, square**0.5) ** 2 > MOST * abs(square - floor**2)


def loudest(errors: dict[str, float], floors, asked) -> str:
    """Of the joints that are `asked` what their error is, the one with the most above its floor.

    Of a floor that is not known the estimate counts, or what is noise in any case: a joint whose
    misfit hides its noise is the one that bends others.
    """
    over = {
        joint: error**2 - (floor.rms or floor.about or floor.low or 0.0) ** 2
        for (joint, error), floor, ask in zip(errors.items(), floors, asked)
        if ask
    }
    over = {joint: more for joint, more in over.items() if more > 0.0}
    return max(over, key=over.get, default="")


def changed(share: float) -> str:
    """A change as a share of what it was, in per cent with its sign."""
    percent = round(100.0 * share, 2) + 0.0  # no zero has a sign of its own
    return f"{percent:+.0f} %" if abs(percent) > 99.5 else f"{percent:+.2g} %"


def notices(claims, refused: Sequence[Refused], fit: Fit) -> list[str]:
    """What to know beside claims, of what is not claimed, and of what is in the model of a fit."""
    heads = [c.head for c in claims if c.after.weights is None and not c.head.size_told]
    told = [f"{r.effect} on {r.joint} is not claimed: {r.why}" for r in refused]
    told += [*at_edges(claims[-1].after), *clocks_anew(claims)] if claims else []
    told += [hidden_by_weights(head.effect, head.joint) for head in heads]
    return told + cancelling(claims) + one_in_motion(fit)


def hidden_by_weights(effect: str, joint: str) -> str:
    """What to know where a fit in which all joints count alike does not tell the size of an effect
    that is there."""
    return (
        f"{effect} on {joint} is there, by how the test error falls, but this fit tells its size "
        f"badly: joints with more noise count as much as quiet ones; {WEIGHED} tells it better"
    )
