"""A robot and logs -> the experiment that they seem to be, with every guess and its reason."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .. import datasets
from .. import robot as machines
from ..robot_spec import RobotSpec
from ..warned import noticed
from . import joints, physics, robots, torques, units, wrapped_angles
from .files import logs_among, opened
from .guess import Draft, Guess
from .logged import Logged, Signals, read, signals
from .split import split

_COMMAND, _NONE = "command", "none"  # the signal; the column of a joint without one
#: what a URDF knows nothing of and nearly every drive has
_EFFECTS = ["viscous", "coulomb", "torque_bias", "armature"]


@dataclass(frozen=True)
class Wishes:
    """What a user states after all: joints, a bag's topic, the rate [Hz] of logs without a
    clock."""

    joints: tuple[str, ...] = ()
    topic: str | None = None
    rate: float | None = None


def draft(reference: str, names: list[str], folder: Path, wishes: Wishes) -> Draft:
    """Look at a robot and its logs.

    Args:
        reference: URDF, xacro or MJCF, as `urdf.locate` takes it. names: logs. folder: where the
        experiment will
            stand; robot.urdf is written there where the robot's file is no URDF.

    Raises:
        SysidError: what cannot be guessed, or cannot be read once it was.
    """
    machine = robots.read(reference)
    urdf = "robot.urdf" if machine.written else _moved(reference, folder)
    if machine.written:
        (folder / "robot.urdf").write_text(machine.written, encoding="utf-8")
    with noticed():  # joints that mimic others are told below
        robot = machines.load(RobotSpec(urdf=urdf), folder)
    arm, hands = joints.arm_and_hands(robot, wishes.joints)
    with noticed() as mended:
        tables, broken = opened(names, wishes.topic)
        tables, passed = logs_among(tables, names, [*arm, *hands])
        found = signals(tables, [*arm, *hands], len(arm))
        data = read(tables, found)
    angles = _angles(data, found, robot)
    used, chosen = joints.chosen(robot, found, data, arm, angles.value)
    clock = units.clock(data, found, wishes.rate)
    wrapped = wrapped_angles.told(data, used, _sliding(robot), angles.value)
    more = joints.unmoved(robot, found, data)
    notes = (*machine.notes, *broken, *passed, *mended, *wrapped, *more)
    out = Draft(urdf, {}, notes, found.rest)
    out = out.having(*machine.guesses, *chosen, *_parts(data, clock, folder, wishes))
    out = out.having(*clock, *_columns(found, used), angles, *_drive(found, used))
    out = out.having(*_lengths(data, found, used, robot))
    if found.torque.meaning.signal == "torque":
        columns = {joint: c for joint, c in found.torque.columns.items() if joint in used}
        out = out.having(*torques.named(columns, _sliding(robot)))
    # a joint in degrees may turn by so much between samples; one that stays within a turn is in rad
    rad = (
        wrapped
        if not angles.alone and wrapped_angles.within_a_turn(data, used, _sliding(robot))
        else ()
    )
    return physics.held_against(out, found, folder, wrapped, rad=bool(rad))


def _moved(reference: str, folder: Path) -> str:
    """A file's path from the experiment's folder; other references as they are."""
    if "://" in reference or datasets.reference(reference) is not None:
        return reference
    return Path(os.path.relpath(Path(reference).resolve(), folder.resolve())).as_posix()


def _angles(data: list[Logged], found: Signals, robot) -> Guess:
    slides, limits = _sliding(robot), dict(zip(robot.joints, robot.limits))
    q = _positions(data, found.joints)
    said = {unit for j, unit in found.position.units.items() if unit and not slides[j]}
    named = said.pop() if len(said) == 1 else found.position.meaning.unit
    guess = units.position_unit(q, slides, limits, named)
    doubt = units.mixed(data, [joint for joint in found.joints if not slides[joint]])
    return replace(guess, doubt=doubt) if doubt else guess


def _lengths(data: list[Logged], found: Signals, used: list[str], robot) -> list[Guess]:
    """Where joints that slide beside others that turn are in mm."""
    slides, limits = _sliding(robot), dict(zip(robot.joints, robot.limits))
    if found.position.meaning.unit:
        return []
    own = units.millimetres(_positions(data, used), slides, limits)
    own += [j for j in used if found.position.units.get(j) == "mm" and j not in own]
    return units.in_mm(own, found.position.columns)


def _positions(data: list[Logged], joints: list[str]) -> dict[str, np.ndarray]:
    return {joint: np.concatenate([one.q[joint] for one in data]) for joint in joints}


def _sliding(robot) -> dict[str, bool]:
    return dict(zip(robot.joints, map(bool, robot.prismatic)))


def _parts(data: list[Logged], clock: list[Guess], folder: Path, wishes: Wishes) -> list[Guess]:
    """data.train and data.test."""
    said = {guess.key: guess.value for guess in clock}
    topic = {"topic": wishes.topic} if wishes.topic else {}
    entries = [{"file": _moved(one.name, folder), **topic} for one in data]
    seconds = [units.seconds(one.t, one.samples, one.table.clock, said) for one in data]
    return list(split(entries, seconds, [one.episodes for one in data]).values())


def _columns(found: Signals, used: list[str]) -> list[Guess]:
    """Columns of angles and torques."""
    angle, torque = found.position.of(used), found.torque
    out = [Guess("data.columns.position", angle.said, angle.why)]
    if torque.meaning.signal == _COMMAND:
        return out
    said = torque.pattern or [torque.columns.get(joint, _NONE) for joint in used]
    doubt = "asked for or computed, not measured, by the names" if torque.meaning.away > 1 else ""
    return [*out, Guess("data.columns.torque", said, torque.why, doubt)]


def _drive(found: Signals, used: list[str]) -> list[Guess]:
    """What stands for torque, and what the drives are likely to have."""
    out, kind = [], found.torque.meaning.signal
    if kind == "current":
        out.append(Guess("data.units.torque", "A", "the columns are currents by their names"))
    if kind == _COMMAND:
        free = {"kp": "free", "kd": "free", "delay": "free"}
        commands = {j: c for j, c in found.torque.columns.items() if j in used}
        why = (
            "no torque was logged, but positions that were asked for: servos, whose gains are found"
        )
        tie = "masses, friction and gains share a factor until a body is known (prior.known), or kp"
        servos = {joint: {"command": column, **free} for joint, column in commands.items()}
        out.append(Guess("actuator", servos, why, tie))
    why = "friction, a bias and the rotors' inertia, which a URDF does not hold"
    window = "chosen on held-out stretches of the training logs"
    out.append(Guess("preprocess.window", "auto", window))
    each = "each joint's error counts by its own noise; none: all alike"
    return [*out, Guess("model.effects", _EFFECTS, why), Guess("solver.weighting", "noise", each)]
