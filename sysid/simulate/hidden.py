"""What can be hidden in a simulated robot: the words, their parameters, and how strong they are where nothing is said."""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass, field

import numpy as np

from ..errors import SysidError
from ..robot import Robot
from .usual_sizes import CATALOGUE, ROBOT, Entry, Scales

#: values that are words: what they may be, None where that depends on the robot
WORDS: dict[str, tuple[str, ...] | None] = {"other": None, "reports": ("actual", "command")}


@dataclass(frozen=True)
class Hidden:
    """An effect, the joint that has it (`*`: the whole robot), and its values by name; what is left out is drawn."""

    effect: str
    joint: str
    values: dict[str, float | str] = field(default_factory=dict)


def hidden(text: str) -> Hidden:
    """Read EFFECT:JOINT[:name=value,...], as in stribeck:hip:dF=2,vs=0.1.

    Raises:
        SysidError: it says something else, or an effect or a parameter that there is not.
    """
    form = "EFFECT:JOINT[:name=value,...], as in stribeck:hip:dF=2,vs=0.1"
    effect, colon, rest = text.partition(":")
    joint, second, tail = rest.rpartition(":")
    if not second or "=" not in tail:
        joint, tail = (joint, "") if second and not tail else (rest, "")
    if not colon or not effect or not joint or "=" in joint:
        raise SysidError(f"cannot be read: {text!r}", where="--hide", allowed=form)
    values: dict[str, float | str] = {}
    for word in tail.split(",") if tail else []:
        name, equals, value = (part.strip() for part in word.partition("="))
        if not equals or not name:
            raise SysidError(f"{word!r} in {text!r}", where="--hide", allowed="name=value", do=f"write {form}")
        if name in values:
            raise SysidError(f"{name!r} twice in {text!r}", where="--hide", do="give it once")
        if name in WORDS:
            values[name] = value
            continue
        try:
            values[name] = float(value)
        except ValueError:
            raise SysidError(f"{name}={value!r} in {text!r}", where="--hide", allowed="a number") from None
    found = Hidden(effect, joint, values)
    _check_words(found)
    return found


def _check_words(hide: Hidden) -> Entry:
    if hide.effect not in CATALOGUE:
        close = difflib.get_close_matches(hide.effect, CATALOGUE, n=3, cutoff=0.5) or list(CATALOGUE)
        raise SysidError(f"there is no effect {hide.effect!r} to hide", where="--hide", allowed=", ".join(close))
    entry = CATALOGUE[hide.effect]
    known = (*entry.names, *entry.also, "size")
    for name, value in hide.values.items():
        numbered = any(re.fullmatch(rf"{stem}[1-9][0-9]?", name) for stem in entry.numbered)
        if name not in known and not numbered:
            raise SysidError(f"{hide.effect} has no parameter {name!r}", where="--hide", allowed=", ".join(known))
        if name in WORDS:
            allowed = WORDS[name]
            if allowed is not None and value not in allowed:
                raise SysidError(f"{hide.effect}: {name}={value}", where="--hide", allowed=" or ".join(allowed))
            continue
        if not isinstance(value, (int, float)) or not math.isfinite(value) or abs(value) > 1e9:
            raise SysidError(f"{hide.effect}: {name}={value}", where="--hide", allowed="a finite number, at most 1e9 in size")
        if (name in entry.positive or name == "size") and not value > 0:
            raise SysidError(f"{hide.effect}: {name}={value:g}", where="--hide", allowed="a positive number")
    return entry


def check(hide: Hidden, robot: Robot) -> None:
    """Raise SysidError, in one line, where an effect cannot be hidden in this robot."""
    entry = _check_words(hide)
    if entry.robot and hide.joint != ROBOT:
        raise SysidError(f"{hide.effect} is an effect of the whole robot, not of {hide.joint!r}", where="--hide", allowed=f"{hide.effect}:{ROBOT}")
    if not entry.robot and hide.joint not in robot.joints:
        close = difflib.get_close_matches(hide.joint, robot.joints, n=1, cutoff=0.6)
        do = f"did you mean {close[0]}?" if close else ""
        raise SysidError(f"{hide.effect}: no joint {hide.joint!r} moves", where="--hide", allowed=", ".join(robot.joints), do=do)
    if hide.effect == "joint_coupling":
        other = hide.values.get("other")
        others = [name for name in robot.joints if name != hide.joint]
        if not others:
            raise SysidError("joint_coupling needs two joints, and the robot has one", where="--hide")
        if other is not None and other not in others:
            raise SysidError(f"joint_coupling: other={other}", where="--hide", allowed=", ".join(others))


def defaults(effect: str, joint: str, scales: Scales, rng: np.random.Generator, *, size: float = 1.0) -> dict[str, float | str]:
    """Random plausible parameters of an effect on a joint of these scales; `size` multiplies its strength."""
    j = 0 if joint == ROBOT else scales.joints.index(joint)
    drawn = CATALOGUE[effect].draw(scales, j, size, rng)
    return {name: value if isinstance(value, str) else float(value) for name, value in drawn.items()}


def settled(hide: Hidden, robot: Robot, scales: Scales, rng: np.random.Generator) -> Hidden:
    """The effect with every value: given, or drawn.

    Raises:
        SysidError: it cannot be hidden in this robot, or its values make friction negative.
    """
    check(hide, robot)
    given = {name: value for name, value in hide.values.items() if name != "size"}
    values = defaults(hide.effect, hide.joint, scales, rng, size=float(hide.values.get("size", 1.0)))
    if hide.effect == "position_friction" and given:
        values = {}  # one harmonic given means that one alone
    if hide.effect == "cable" and given:
        values = dict.fromkeys(values, 0.0)
    if hide.effect == "cogging" and {"a1", "b1"} & set(given):
        # a sin(k q + phase) = a1 sin(k q) + b1 cos(k q)
        a1, b1 = float(given.pop("a1", 0.0)), float(given.pop("b1", 0.0))
        given = {"a": math.hypot(a1, b1), "phase": math.atan2(b1, a1), **given}
    if given.get("reports") == "command":
        # torque that is missing throws a robot off its motion, where a flat reading does not: a third of the depth
        values["limit"] = float(2.0 * scales.peak[scales.joints.index(hide.joint)] + values["limit"]) / 3.0
    values |= given
    if "eta" in values:
        eta = float(values.pop("eta"))
        if not 0.0 < eta < 1.0:
            raise SysidError(f"directional_efficiency: eta={eta:g}", where="--hide", allowed="between 0 and 1")
        values["e"] = 1.0 / eta - 1.0
    if "s0" in values:
        values["x0"] = float(values["F"]) / float(values.pop("s0"))
    j = 0 if hide.joint == ROBOT else scales.joints.index(hide.joint)
    bounds = {
        "asymmetric_coulomb": ("dF", 2.0 * scales.coulomb[j]), "asymmetric_viscous": ("dFv", 2.0 * scales.viscous[j]), "sublinear_viscous": ("a", 1.0),
        "presliding": ("share", 1.0), "torque_gain": ("e", 0.95), "load_friction": ("mu", 0.5), "directional_efficiency": ("e", 0.5),
        "encoder_eccentricity": ("d", 0.5), "gravity_tilt": ("roll", 1.5),
    }  # fmt: skip
    if hide.effect in bounds:
        name, most = bounds[hide.effect]
        if abs(float(values[name])) > most:
            raise SysidError(f"{hide.effect}: {name}={values[name]:g}", where="--hide", allowed=f"at most {most:.4g} in size on this joint")
    return Hidden(hide.effect, hide.joint, values)
