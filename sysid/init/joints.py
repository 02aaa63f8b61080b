"""Which joints are identified, and which are locked where: grippers, joints that stand still, that
lack columns."""

from __future__ import annotations

import numpy as np

from .. import beyond
from ..errors import ConfigError, LogError
from ..robot import HELD, Robot, followers
from ..units import ANGLES
from .guess import Guess
from .logged import Logged, Signals
from .robots import grips
from .words import words

_STILL = 1e-3  # rad or m: a joint that travels less was held


def arm_and_hands(robot: Robot, wished: tuple[str, ...]) -> tuple[list[str], list[str]]:
    """The joints of the arm and those of grippers; those that the user names are the arm.

    Raises:
        ConfigError: a joint is named that does not move.
    """
    if wished:
        if unknown := [joint for joint in wished if joint not in robot.joints]:
            raise ConfigError(
                f"--joints names {unknown[0]!r}, which does not move",
                allowed=", ".join(robot.joints),
                do="correct it",
            )
        return list(wished), []
    hands = [joint for joint in robot.joints if grips(robot.source.joints[joint])]
    arm = [joint for joint in robot.joints if joint not in hands]
    return (arm, hands) if arm else (hands, [])


def chosen(
    robot: Robot, signals: Signals, data: list[Logged], arm: list[str], unit: str
) -> tuple[list[str], list[Guess]]:
    """The joints to identify, and the guesses that say so.

    Args:
        robot: with every joint that moves. arm: those that are no gripper's. unit: of angles.

    Raises:
        LogError: none is left.
    """
    used, unused, lock, whys, passed = [], [], {}, [], []
    for joint, slides in zip(robot.joints, robot.prismatic):
        values = _logged(data, joint, _si(unit, slides))
        travel = 0.0 if values is None else float(np.ptp(values))
        if joint in arm and travel > _STILL:
            used.append(joint)
            if not _told(data, joint):
                unused.append(joint)
            continue
        lock[joint], why = _locked(robot, joint, values)
        if values is None and (own := _passed_over(signals, joint)) and joint in arm:
            passed.append(f"nothing was made of {', '.join(own)}, which carry the name of {joint}")
        reason = "stands still" if values is not None else "has no columns"
        whys.append(f"{joint} {reason if joint in arm else 'moves a gripper'}: {why}")
    if len(used) == len(unused):
        raise LogError(
            "no joint of the URDF moves in these logs with a torque beside it",
            where=data[0].name,
            allowed=", ".join(robot.joints),
            do="log a motion with torques",
        )
    order = [joint for joint in arm if joint in used]
    out = [Guess("robot.joints", order, *_why(robot, signals, order))]
    if unused:
        own = [joint for joint in order if joint in unused]
        why = "they move, and no column holds their torque, or one that never changes"
        known = [column for joint in own for column in _passed_over(signals, joint)]
        shown = f", {', '.join(known)}" if known else ""
        doubt = f"is the torque of {', '.join(own)} logged under another name{shown}?"
        out.append(Guess("data.unused", own, why, doubt))
    if robot.locked:
        whys.append(f"{', '.join(robot.locked)}, by <mimic>: locked at 0")
    moved = {name: leader for name, leader in followers(robot.source).items() if leader in order}
    moving = {name: leader for name, leader in moved.items() if name in robot.locked}
    passed += [HELD.format(name, leader) for name, leader in moving.items()]
    doubt = "; ".join(passed)
    return order, [*out, Guess("robot.lock", lock, "; ".join(whys), doubt)] if whys else out


def unmoved(robot: Robot, signals: Signals, data: list[Logged]) -> list[str]:
    """What to look at where a log has angle and torque of a joint that the robot's file does not
    know; of one that is fixed there a check says so.
    """
    first = data[0].table
    known = {*robot.joints, *robot.locked}
    patterns = signals.position.pattern, signals.torque.pattern
    columns = beyond.beyond(signals.rest, *patterns, known)
    try:
        moving = beyond.moving(columns, first.load(list(columns.values()))) if columns else []
    except LogError:  # of what nobody asked for
        return []
    new = [joint for joint in moving if joint not in robot.source.joints]
    return ["; ".join(beyond.says(joint, columns[joint], ())) for joint in new]


def _passed_over(signals: Signals, joint: str) -> list[str]:
    """Columns that carry a joint's name, and of which nothing was made."""
    own = words(joint)
    runs = lambda said: (said[k : k + len(own)] for k in range(len(said)))  # noqa: E731
    return [column for column in signals.rest if own in runs(words(column))]


def _logged(data: list[Logged], joint: str, scale: float) -> np.ndarray | None:
    """The angles of a joint in all logs; None where one lacks it, or has it in other rows."""
    parts = [one.q[joint] for one in data if joint in one.q]
    whole = len(parts) == len(data) and all(len(p) == one.samples for p, one in zip(parts, data))
    return np.concatenate(parts) * scale if whole else None


def _told(data: list[Logged], joint: str) -> bool:
    """Whether a joint has a torque that is more than a constant."""
    return any(np.ptp(one.tau[joint]) > 0.0 for one in data if joint in one.tau)


def _si(unit: str, slides: bool) -> float:
    if slides:
        return 1e-3 if unit == "mm" else 1.0
    return ANGLES.get(unit, 1.0)


def _locked(robot: Robot, joint: str, values) -> tuple[float, str]:
    """Where a joint is locked: at its mean within its limits, at 0 where nothing was logged."""
    low, high = robot.limits[robot.joints.index(joint)]
    mean = 0.0 if values is None else float(np.mean(values))
    value = float(np.clip(mean, low, high)) if high > low else mean
    if values is None:
        return value, f"locked at {value:.4g}"
    return float(f"{value:.6g}"), f"locked at its mean {value:.4g}"


def _why(robot: Robot, signals: Signals, used: list[str]) -> tuple[str, str]:
    why = f"{len(used)} of {len(robot.joints)} joints that move have angles and torques in the logs"
    if not (signals.position.counted or signals.torque.counted):
        return why, ""
    found = signals.position if signals.position.counted else signals.torque
    return why, f"{found.why}: {', '.join(found.columns)}; is that the logger's order?"
