"""What a fit says that cannot be meant: sentences, each with its figure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .blocks import averaged
from .estimate import Fit
from .prediction import Prediction

_EFFORT, _FEWEST = 1.5, 3  # times what the URDF allows the drive, and in how many samples
BEGINS = "implausible"  # a notice that makes all the rest doubtful
WORSE = "the model is worse than none on the test logs of"
WRONG = "a check of these logs finds their columns wrong"
ASK = "are its columns, signs and units right? `sysid check` says"
IN_EACH_LOG = "what is left is another mean in each log"
AT_REST = "it stands in the test logs, and what is left is friction at rest, which no model tells"
OF_ITS_OWN = "`data.groups`, and an effect that is `per:` a group, give each its own; a zero is best set alike before every log"
_ALIKE = 1.1  # times an error: two that differ by less are alike
_BLOCKS = 10  # of a log, whose means say how far its own may be off
_CHANCE = 1e-3  # of a log that stands apart from the others, were there nothing
_SHARE = 0.1  # of a joint's squared error that its logs' means must make
ROWS = 200_000  # that tell a mean, or an error


@dataclass(frozen=True)
class Reason:
    """What else than a law of the robot may be what is left of a joint, in words, of which no other log tells more. settles: all of
    it, whatever else may be."""

    says: str
    settles: bool = False


def implausible(fit: Fit, still: Sequence[str] = (), logs: Sequence[dict] = ()) -> Iterator[str]:
    """Joints that the model explains worse than their mean, that stand in the test logs, whose error is another in each log; torque
    beyond the drive's. Of masses see `masses`.

    Args:
        still: joints that stand in the test logs. logs: what logs there are, part and name of each, as documents have them.
    """
    train, test = (fit.predictions[part].errors() for part in ("train", "test"))
    rests = [joint for joint in fit.joints if joint in still]
    # at the error of the training logs, which it does explain, the torque of the test logs hardly varies
    carries = (test["rms"] <= _ALIKE * train["rms"]) & (train["r2"] > 0.0)
    worse = [f"{joint} (R2 {r2:.2g})" for joint, r2, well in zip(fit.joints, test["r2"], carries) if r2 < 0.0 and not well and joint not in rests]
    if worse:
        yield f"{BEGINS}: {WORSE} {', '.join(worse)}; {ASK}"
    if moved := [joint for joint in rests if np.isfinite(test["r2"][fit.joints.index(joint)]) and joint not in stands(fit)]:
        yield (
            f"the test logs do not show {', '.join(moved)} in motion: the error there is friction at rest, which no model tells, and "
            "says nothing of the model; hold out a log in which it moves"
        )
    yield from _apart(fit, logs, rests)
    robot, greatest = fit.model.robot, fit.predictions["train"].greatest(_FEWEST)
    for j, joint in enumerate(fit.joints):
        allowed = robot.source.joints[joint].effort
        torque = greatest[:, j]
        if np.sum(torque > _EFFORT * allowed) >= _FEWEST:
            yield f"{BEGINS}: the torque of {joint} reaches {torque.max():.4g}, the URDF allows its drive {allowed:.4g}; {ASK}"


def stands(fit: Fit) -> set[str]:
    """Joints whose friction is held, as they stand in the training logs, too."""
    own = zip(fit.model.coefficients, fit.held)
    return {fit.joints[c.joint] for c, held in own if held and c.effect == "coulomb" and c.joint >= 0}


def _apart(fit: Fit, logs: Sequence[dict], still: Sequence[str]) -> Iterator[str]:
    """Joints whose error has another mean in some logs, where that is much of it."""
    for joint, (share, _, said) in other_means(fit, logs, still).items():
        if share > _SHARE:
            yield f"{_left(joint)}, in the mean {said}: a torque's zero that was set anew, a load, or what hangs on the place; {OF_ITS_OWN}"


def _left(joint: str) -> str:
    return f"what is left of {joint} is another in some logs"


def outdated(fit: Fit, last: Fit) -> list[str]:
    """Notices of a fit on means by log, and on masses and what would bring them back, that another one, with what is claimed, has none
    of."""
    before, after = ({joint: found[0] for joint, found in other_means(one, one.logs).items()} for one in (fit, last))
    gone = tuple(_left(joint) for joint in before if after.get(joint, 0.0) <= _SHARE)
    gone += (fit.masses["says"],) if fit.masses and not last.masses else ()
    return [notice for notice in fit.notices if notice.startswith(gone)]


def centred(fit: Fit) -> Fit:
    """A fit with what it leaves of each log about its mean there, of every joint: as with a torque's zero that was set anew in each.
    Of logs that do not stand in memory, of a part."""
    return replace(fit, predictions={part: _centred(told.thinned(ROWS)) for part, told in fit.predictions.items()})


def _centred(told: Prediction) -> Prediction:
    predicted, use = np.array(told.predicted), np.ones(told.predicted.shape, dtype=bool) if told.use is None else told.use
    for log in np.unique(told.log):
        own = told.log == log
        left = np.where(use[own], told.measured[own] - predicted[own], 0.0)
        predicted[own] += left.sum(0) / np.maximum(use[own].sum(0), 1)
    return Prediction(told.log, told.t, told.measured, predicted, told.use, told.joints, told.units)


def other_means(fit: Fit, logs: Sequence[dict], still: Sequence[str] = ()) -> dict[str, tuple[float, float, str]]:
    """{joint: (the share of its squared error that its logs' means make, their mean square, these in words)}, of joints whose error
    has clearly another mean in some logs.

    Args:
        logs, still: as of `implausible`.
    """
    from scipy.special import stdtrit

    named = [(part, k, own["log"]) for part in ("train", "test") for k, own in enumerate(o for o in logs if o["part"] == part)]
    if len(named) < 2:
        return {}
    parts, out = {part: told.thinned(ROWS) for part, told in fit.predictions.items()}, {}
    for j, joint in enumerate(fit.joints):
        if joint in still:
            continue
        left = {part: told.of_joint(j)[2] for part, told in parts.items()}
        each = [_mean(left[part][(parts[part].log == k) & np.isfinite(left[part])]) for part, k, _ in named]
        known = [(name, *own) for (*_, name), own in zip(named, each) if own is not None]
        if len(known) < 2:
            continue
        means, errors, counts, squares = np.array([own[1:] for own in known]).T
        middle = means - np.average(means, weights=counts)
        far = np.abs(middle) > stdtrit(_BLOCKS - 1, 1.0 - 0.5 * _CHANCE / len(known)) * errors
        if far.any():
            unit, square = fit.predictions["test"].units[j], np.sum(counts * middle**2)
            said = ", ".join(f"{mean:+.2g} {unit} in {name}" for (name, *_), mean, own in zip(known, middle, far) if own)
            out[joint] = float(square / max(np.sum(squares), 1e-300)), float(square / np.sum(counts)), said
    return out


def _mean(left: np.ndarray) -> tuple[float, float, int, float] | None:
    """Mean of an error (n,), its standard error by blocks of time, rows and sum of squares; None of too few."""
    if len(left) < 2 * _BLOCKS:
        return None
    return *averaged(left, _BLOCKS), len(left), float(left @ left)
