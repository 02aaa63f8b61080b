"""What the angles show by themselves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...full_turns import ADVICE, TURN
from ...lowpass.angles import grains
from ...units import DEGREE, in_millimetres
from ..fault import ERROR, WARNING, Fault
from ..look import Logged, Look
from ..tally import FASTER, lag_of

AFTER, SENSELESS = 1, ("wrong_unit", "joint_order")
_COARSE = TURN / 2**12  # rad: a velocity by differences then is mostly steps
_UNITS = 20.0  # times: degrees and radians are 57 apart, and motions of one robot less
ASK = "is this the joint's column, its unit, its zero, this robot's URDF?"
GEARED = (
    "an angle that goes farther than its limits are apart may be the motor's, before its gear: then "
    "divide it by the gear's ratio and multiply the torque by it; else " + ASK
)
_BEYOND = 1.5  # times what limits allow: no joint goes so far, whatever its zero
_STILL, _MOSTLY = 0.01, 0.6  # of a joint's top speed; of the samples


def find(look: Look) -> Iterator[Fault]:
    """angle_wrap, wrong_unit, limit_exceeded, coarse_values, standstill, not_excited."""
    for j, joint in enumerate(look.robot.joints):
        slides = bool(look.robot.prismatic[j])
        wrong = False
        for log in look.logs:
            for fault in _of_log(look, log, j, joint, slides):
                wrong |= fault.severity == ERROR
                yield fault
        if not wrong:
            yield from _of_training(look, j, joint)


def _of_log(look: Look, log: Logged, j: int, joint: str, slides: bool) -> Iterator[Fault]:
    own, name = log.tally.joints[j], log.log.name
    if own.wraps.count and np.median(np.abs(np.diff(log.column("q", j)))) < 0.1 * TURN:
        times = own.wraps.times
        yield Fault(
            "angle_wrap",
            ERROR,
            (
                f"the angle of {joint} jumps by a turn {own.wraps.count} times in {name}, "
                f"first at {times[0]:.4g} s"
            ),
            ADVICE,
            joint,
            name,
            times,
            own.wraps.count,
        )
        return
    low, high = look.robot.limits[j]
    allowed = look.robot.source.joints[joint].velocity
    fast = own.fast.count and np.quantile(log.speeds(j), 0.999) > FASTER * allowed
    # a joint without limits may make many turns, and no faster than its drive; of a drive without
    # one nobody knows
    endless = not np.isfinite(high - low) and not fast
    told = not (endless and np.isfinite(allowed))
    stated = look.experiment.data.units.position
    if own.far.count and told and (stated == "rad" or _alone(look, log, j)):
        if stated == "rad":
            read, do = "", _degrees(look, log, joint)
        else:
            read = f" with `position: {stated}` under `units:`, and does not in other logs"
            do = f"give the angles in {name} in {stated}, as in the others"
        yield Fault(
            "wrong_unit",
            WARNING if endless else ERROR,
            f"{joint} reaches {own.far.most:.4g} rad in {name}, {own.far.most / TURN:.2g} turns{read}",
            do,
            joint,
            name,
            (own.far.at,),
            own.far.count,
        )
        return
    if slides and own.beyond.count and in_millimetres(log.column("q", j), low, high):
        yield Fault(
            "wrong_unit",
            ERROR,
            f"{joint} is at {own.beyond.value:.4g} m in {name}: as mm that is within its limits",
            _millimetres(look, joint),
            joint,
            name,
            (own.beyond.at,),
            own.beyond.count,
        )
        return
    if own.beyond.count:
        yield Fault(
            "limit_exceeded",
            WARNING,
            (
                f"{joint} is at {own.beyond.value:.4g} in {name}, beyond its limits of "
                f"{low:.4g} to {high:.4g}"
            ),
            GEARED if farther(look, j) else ASK,
            joint,
            name,
            (own.beyond.at,),
            own.beyond.count,
        )
    if fast:
        yield Fault(
            "limit_exceeded",
            WARNING,
            f"{joint} moves at {own.fast.most:.3g} in {name}, its limit is {allowed:.3g}",
            "is this the joint's column, its unit, this robot's URDF?",
            joint,
            name,
            (own.fast.at,),
            own.fast.count,
        )
    grain = float(grains(log.column("q", j)[:, None])[0])
    if not slides and grain > _COARSE:
        yield Fault(
            "coarse_values",
            WARNING,
            (
                f"the angle of {joint} comes in steps of {grain:.2g} rad in {name}, "
                f"{TURN / grain:.0f} a turn"
            ),
            "log it with more digits, or on the motor's side of the gear",
            joint,
            name,
            rows=log.samples,
        )


def farther(look: Look, j: int) -> bool:
    """Whether a joint goes clearly farther in some log than its limits are apart, where it has any."""
    low, high = look.robot.limits[j]
    most = max(float(log.tally.travel[j]) for log in look.logs)
    return bool(0.0 < high - low < np.inf and most > _BEYOND * (high - low))


def _alone(look: Look, log: Logged, j: int) -> bool:
    """Whether a joint travels in a log so many times as far as in the one where it travels least, that
    these are two units."""
    travel = [float(one.tally.travel[j]) for one in look.logs]
    return float(log.tally.travel[j]) > _UNITS * min(travel) > 0.0


def _millimetres(look: Look, joint: str) -> str:
    """What to write where a joint's position is in mm."""
    data, column = look.experiment.data, look.column("position", joint)
    if column is None or joint in data.position or data.columns.velocity is not None:
        return "give it in m"
    if data.units.position == "rad" and np.sum(look.robot.prismatic) == 1:
        return "set data.units.position: mm"
    return f"write data.position: {{{joint}: {{{column}: 0.001}}}}"


def _degrees(look: Look, log: Logged, joint: str) -> str:
    """What to write where a joint's angle is in degrees: as all are, or as it alone, or in one log."""
    if not all(any(own.far.count for own in one.tally.joints) for one in look.logs):
        unit = "set data.units.position: deg"
        return f"if all logs are in degrees {unit}; if {log.log.name} alone is, give it in rad"
    far = [one for one, own in zip(look.robot.joints, log.tally.joints) if own.far.count]
    column = look.column("position", joint)
    if len(far) > 1 or column is None or look.robot.dof < 2:
        return "if that is degrees set data.units.position: deg"
    alone = f"{{{joint}: {{{column}: {DEGREE}}}}}"
    return f"if it alone is in degrees write data.position: {alone}; if all are, data.units.position: deg"


def _of_training(look: Look, j: int, joint: str) -> Iterator[Fault]:
    own, long = look.part("train"), look.with_speeds
    moves = look.excited[j]
    if not moves.enough:
        worked = any(log.tally.swing[j] > 0.0 for log in own)
        dead = (
            "is it the joint's column? its torque changes; " if not moves.travel and worked else ""
        )
        yield Fault(
            "not_excited",
            WARNING,
            (
                f"{joint} travels {moves.travel:.2g} at up to {moves.top:.2g} a second in the "
                "training logs: what it carries and its friction stay as the prior says"
            ),
            f"{dead}log it moving, or leave it out with robot.lock",
            joint,
            rows=sum(log.samples for log in own),
        )
        return
    still = moves.speeds < _STILL * moves.top
    if np.mean(still) > _MOSTLY:
        yield Fault(
            "standstill",
            WARNING,
            (
                f"{joint} stands in {100 * np.mean(still):.0f} % of the training "
                "samples, where its friction may have any value up to its greatest"
            ),
            "log more motion; preprocess.standstill: auto leaves these rows out",
            joint,
            rows=round(float(np.mean(still)) * sum(log.samples - lag_of(log.step) for log in long)),
        )
