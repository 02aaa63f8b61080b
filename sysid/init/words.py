"""What the name of a column says: which signal, whether measured or commanded, which unit.

A name is taken apart into words, "actual_q_0" and "JointPosition[2]" alike.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from ..units import WORDS as UNITS

#: {signal: the words for it that logs of robots use}
SIGNALS = {
    "position": {"q", "pos", "position", "positions", "angle", "angles", "theta", "qpos", "jpos"},
    "velocity": {"qd", "dq", "vel", "velocity", "velocities", "qvel", "speed", "omega", "qdot"},
    "acceleration": {"qdd", "ddq", "acc", "accel", "acceleration", "accelerations", "qacc"},
    "torque": {"tau", "torque", "torques", "effort", "efforts", "trq", "moment", "force", "load"},
    "current": {"i", "iq", "current", "currents", "curr", "amp", "amps", "ampere", "amperes"},
    "other": {"temp", "temperature", "voltage", "volt", "volts", "pwm", "duty", "error", "err"}
    | {"mode", "status", "flag", "cartesian", "tcp", "tool", "ee", "eef", "x", "y", "z", "acc"},
}
#: two words that are one signal, "theta dot"
_DERIVED = {"dot": "velocity", "ddot": "acceleration"}
#: asked for, or made by a model: not what the joint did
COMMANDED = {"des", "desired", "cmd", "command", "commanded", "target", "ref", "reference", "goal"}
COMMANDED |= {"set", "setpoint", "action", "d"}
MADE = {"ext", "external", "residual", "model", "gravity", "coriolis", "ff", "feedforward", "est"}
MADE |= {"estimated", "friction", "prev", "previous"}
MEASURED = {"measured", "meas", "actual", "act", "state", "observed", "observation", "observations"}
TIME = {"t", "time", "times", "timestamp", "timestamps", "stamp", "stamps", "clock"}
_BESIDE_TIME = {
    "ros",
    "field",
    "header",
    "system",
    "robot",
    "unix",
    "epoch",
    "log",
    "since",
    "start",
}
COUNTS = {"enc", "encoder", "count", "counts", "tick", "ticks"}
_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")


def words(name: str) -> tuple[str, ...]:
    """The words and numbers of a name in lower case: ("actual", "q", "0")."""
    return tuple(word.lower() for word in _WORD.findall(name))


@dataclass(frozen=True)
class Meaning:
    """What words say: a signal ("" where they say none; "command" is a position asked for), how far
    they are from a plain measurement (0 is one; what was asked for, or made by a model, is more),
    and the unit they name ("" for none)."""

    signal: str
    away: int
    unit: str


def meaning(said: tuple[str, ...]) -> Meaning:
    """What the words of a column say that are not its joint's."""
    signals = [signal for signal, known in SIGNALS.items() if set(said) & known]
    derived = [_DERIVED[word] for word in said if word in _DERIVED]
    found = derived[-1:] or [signal for signal in signals if signal != "other"][-1:]
    # "current" beside "position" is the present one; beside "torque" it is the motor's
    if {"current", "position"} <= set(signals) and {"current", "curr"} & set(said):
        found = ["position"]
    if {"current", "torque"} <= set(signals):
        found = ["torque"]
    signal = "" if "other" in signals or not found else found[0]
    away = 4 * bool(set(said) & MADE) + 2 * bool(set(said) & COMMANDED)
    away += 0 if set(said) & MEASURED or away else 1
    if signal == "position" and set(said) & COMMANDED:
        signal = "command"
    kind = {"current": "torque", "command": "position"}.get(signal, signal)
    units = [UNITS[kind][word] for word in said if word in UNITS.get(kind, {})]
    if set(said) & COUNTS and signal in ("", "position"):
        return Meaning("position", away, "counts")
    return Meaning(signal, away, units[0] if units else "A" if signal == "current" else "")


def is_time(name: str) -> bool:
    """Whether a name says that its column is a clock."""
    said = set(words(name))
    return bool(said & TIME) and said <= TIME | _BESIDE_TIME | set(UNITS["time"])
