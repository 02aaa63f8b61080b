"""A log's motors and actuators -> its joints: positions and torques that are sums of logged signals, and the torque of
drives whose command was logged in its place.

A sum's factors may be free. One signal of a joint leads: the first with a known factor, or the first of all where none is
known. What is logged is then, with f for factors,

    f_lead s_lead + sum of known f s = torque - sum of free f s,

times f_start / f_lead where the leading factor itself is free: a free factor is a wrong scale of what is measured, so that
a small factor makes no small error. A servo or a DC motor is the same with one signal,

    kp (command(t - delay) - q) = torque + kd qd        and        k / R voltage(t - delay) = torque + k^2 / R qd.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from .drive_spec import ActuatorSpec, FreeFactor
from .errors import ConfigError
from .log_spec import DataSpec


@dataclass(frozen=True)
class Drive:
    """What stands for a joint's torque: `factor` times a command (less the joint's position, where `servo`) or voltage.

    column: of the command. damping: known [N m s/rad], or None where it is free. delay [s]: known, or
    found and still free to move about that.
    """

    column: str | int
    servo: bool
    factor: float | FreeFactor
    damping: float | None
    delay: float
    free_delay: bool = False

    @property
    def start(self) -> float:
        """The factor by which the log is read."""
        return started(self.factor)


def drive(spec: ActuatorSpec) -> Drive:
    """What an actuator's entry says."""
    delay = (spec.delay.start or 0.0) if isinstance(spec.delay, FreeFactor) else float(spec.delay)
    moves = isinstance(spec.delay, FreeFactor)
    if spec.command is not None:
        damping = None if isinstance(spec.kd, FreeFactor) else float(spec.kd)
        return Drive(spec.command, True, spec.kp, damping, delay, moves)
    if isinstance(spec.k, FreeFactor):
        return Drive(spec.voltage, False, _ratio(spec.k, spec.R), None, delay, moves)
    return Drive(spec.voltage, False, spec.k / spec.R, spec.k**2 / spec.R, delay, moves)


def _ratio(k: FreeFactor, resistance: FreeFactor) -> FreeFactor:
    """The free factor k / R."""
    starts, within = (k.start, resistance.start), (k.within, resistance.within)
    return FreeFactor(
        start=None if None in starts else starts[0] / starts[1],
        within=None if None in within else [within[0][0] / within[1][1], within[0][1] / within[1][0]],
    )


def started(factor: float | FreeFactor) -> float:
    """A factor's value before any fit."""
    return factor if not isinstance(factor, FreeFactor) else 1.0 if factor.start is None else factor.start


def leading(entry: Mapping[str, float | FreeFactor]) -> str:
    """The signal of a joint's sum that the others are told by."""
    known = [name for name, factor in entry.items() if not isinstance(factor, FreeFactor)]
    return (known or list(entry))[0]


def told(entry: Mapping[str, float | FreeFactor]) -> dict[str, float]:
    """The factors of a sum that stand on the measured side."""
    lead = leading(entry)
    return {name: started(f) for name, f in entry.items() if name == lead or not isinstance(f, FreeFactor)}


def check(data: DataSpec, actuators: Mapping[str, ActuatorSpec], joints: tuple[str, ...]) -> None:
    """Whether every joint named is one, and has one source of torque.

    Raises:
        ConfigError: it is not, or has two.
    """
    given = {"data.torque": data.torque, "data.position": data.position, "data.zero": data.zero, "data.unused": data.unused, "actuator": actuators}
    for key, named in given.items():
        for joint in named:
            if joint not in joints:
                raise ConfigError(f"{key} names the joint {joint!r}", allowed=", ".join(joints), do="correct the joint")
    for joint in joints:
        sources = [key for key, named in given.items() if key not in ("data.position", "data.zero") and joint in named]
        if len(sources) > 1:
            raise ConfigError(f"the torque of joint {joint!r} is told by {' and by '.join(sources)}", allowed="one of them", do="leave one out")
    if data.position and (data.columns.velocity or data.columns.acceleration):
        raise ConfigError(
            "data.position goes with positions alone", allowed="no data.columns.velocity or .acceleration", do="leave these out: the filter takes derivatives of the position",
        )  # fmt: skip
    if set(data.unused) >= set(joints):
        raise ConfigError("data.unused names every joint", allowed="at least one joint whose torque is used", do="leave one out")


def has_column(sums: Mapping[str, Mapping], without, joints: tuple[str, ...]) -> list[bool]:
    """Whether each joint's own column is looked at: it stands in no sum's place, or in its own sum, and is not left out."""
    return [joint in sums.get(joint, {joint: 1.0}) and joint not in without for joint in joints]


def signals_of(sums: Mapping[str, Mapping], joints: tuple[str, ...]) -> list[str]:
    """The names in sums that are no joint's."""
    return list(dict.fromkeys(name for entry in sums.values() for name in entry if name not in joints))


def summed(sums: Mapping[str, Mapping[str, float]], joints: tuple[str, ...], logged, signal: Callable[[str], np.ndarray], key: str) -> np.ndarray:
    """Values (n, dof) of joints, those with a sum in place of what was logged (n, dof). A joint in its own sum stands for its
    own column, any other for that joint's value.

    Raises:
        ConfigError: sums that need each other.
    """
    if not sums:
        return logged
    out: dict[str, np.ndarray] = {}
    return np.stack([_value(joint, sums, joints, logged, signal, key, out, []) for joint in joints], axis=1)


def _value(joint: str, sums, joints, logged, signal, key: str, out: dict[str, np.ndarray], waiting: list[str]) -> np.ndarray:
    """The values (n,) of a joint, of those that its sum needs first; each sum is kept in `out`."""
    if joint in out:
        return out[joint]
    own = logged[:, joints.index(joint)]
    if joint not in sums:
        return own
    if joint in waiting:
        raise ConfigError(f"{key}: {' and '.join(waiting)} need each other", allowed="sums that end at logged columns", do="correct one")
    further = [*waiting, joint]
    other = lambda name: _value(name, sums, joints, logged, signal, key, out, further) if name in joints else signal(name)  # noqa: E731
    out[joint] = np.sum([f * (own if name == joint else other(name)) for name, f in sums[joint].items()], axis=0)
    return out[joint]


def command_name(joint: str) -> str:
    """The signal that is a joint's command as it was given, in SI units."""
    return f"command.{joint}"


def rate_name(joint: str) -> str:
    """The signal that is the rate of a joint's command [1/s]."""
    return f"command_rate.{joint}"


def driven(own: Drive, t, command, q) -> tuple[np.ndarray, np.ndarray]:
    """What a drive's torque (n,) would be without damping, and the rate (n,) of the command then.

    Args:
        t (n,) [s]; command (n,) as it was given, which acts `delay` later; q (n,) of the joint.
    """
    acts = np.interp(t - own.delay, t, command) if own.delay else command
    return own.start * (acts - q if own.servo else acts), np.gradient(acts, t)
