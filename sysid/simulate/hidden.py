"""What can be hidden in a simulated robot: the words, their parameters, and how strong they are where nothing is said."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..errors import SysidError
from ..robot import Robot

ROBOT = "*"  # the joint of an effect of the whole robot
#: values that are words: what they may be, None where that depends on the robot
WORDS: dict[str, tuple[str, ...] | None] = {"other": None, "reports": ("actual", "command")}


@dataclass(frozen=True)
class Hidden:
    """An effect, the joint that has it (`*`: the whole robot), and its values by name; what is left out is drawn."""

    effect: str
    joint: str
    values: dict[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Scales:
    """What the joints of a robot are like, each (dof,): rms and peak torque of the bodies, typical inertia, top speed,
    Coulomb and viscous friction. `mass` [kg] of the last link, `length` [m] of the arm, `force` [N] that its joints bear at the hand,
    `duration` [s] of a log.
    `middle` and `reach` (dof,): the middle angle, and the greatest distance from it; `joints`: the names.
    """

    joints: tuple[str, ...]
    torque: np.ndarray
    peak: np.ndarray
    inertia: np.ndarray
    speed: np.ndarray
    reach: np.ndarray
    middle: np.ndarray
    coulomb: np.ndarray
    viscous: np.ndarray
    mass: float
    length: float
    force: float
    duration: float


def _draw(low: float, high: float) -> Callable:
    return lambda rng: float(rng.uniform(low, high))


def _sign(rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _other(s: Scales, j: int) -> str:
    return s.joints[j - 1 if j > 0 else min(1, len(s.joints) - 1)]


def _bump(s: Scales, j: int, size: float, rng) -> dict:
    c = rng.normal(size=5)
    # over the angles that it travels, so that no power runs away
    x = (s.middle[j] + np.linspace(-s.reach[j], s.reach[j], 101)) / math.pi
    curve = sum(ck * x ** (k + 1) for k, ck in enumerate(c))
    c = c * size * rng.uniform(0.08, 0.15) * s.torque[j] / np.sqrt(np.mean(curve**2))
    return {f"c{k + 1}": float(ck) for k, ck in enumerate(c)}


def _harmonics(s: Scales, j: int, size: float, rng) -> dict:
    direction = rng.normal(size=4)
    direction *= size * rng.uniform(0.5, 0.9) * s.coulomb[j] / np.linalg.norm(direction)
    return dict(zip(("a1", "b1", "a2", "b2"), direction.tolist()))


def _cogging(s: Scales, j: int, size: float, rng) -> dict:
    # 3 to 9 Hz at top speed: a ripple that a log at that speed can show
    k = max(2, round(2.0 * math.pi * rng.uniform(3.0, 9.0) / s.speed[j]))
    return {"k": float(k), "a": size * rng.uniform(0.03, 0.06) * s.torque[j], "phase": rng.uniform(0.0, 2.0 * math.pi)}


def _spring(s: Scales, j: int, size: float, rng) -> dict:
    return {"k": size * rng.uniform(0.10, 0.20) * s.torque[j] / s.reach[j], "q0": s.middle[j] + rng.uniform(-0.5, 0.5) * s.reach[j]}


def _payload(s: Scales, j: int, size: float, rng) -> dict:
    m, edge = size * rng.uniform(0.3, 0.8) * s.mass, 0.1 * s.length
    x, y, z = (rng.uniform(-0.08, 0.08, 3) * s.length).tolist()
    return {"m": m, "x": x, "y": y, "z": z, "lx": edge, "ly": edge, "lz": edge}


def _coupling(s: Scales, j: int, size: float, rng) -> dict:
    return {
        "other": _other(s, j), "Ia": size * rng.uniform(0.2, 0.4) * s.inertia[j], "Fv": size * rng.uniform(0.4, 0.8) * s.viscous[j],
        "Fs": size * rng.uniform(0.4, 0.8) * s.coulomb[j], "Fd": 0.0,
    }  # fmt: skip


def _elasticity(s: Scales, j: int, size: float, rng) -> dict:
    # a larger size is a softer joint; the resonance with the motor held
    omega = 2.0 * math.pi * rng.uniform(8.0, 13.0) / math.sqrt(size)
    K = omega**2 * s.inertia[j]
    return {"K": K, "D": 2.0 * rng.uniform(0.04, 0.08) * K / omega}


@dataclass(frozen=True)
class Entry:
    """An effect that can be hidden: its parameters, what draws them, which must be positive, whether the robot has it."""

    names: tuple[str, ...]
    draw: Callable[[Scales, int, float, np.random.Generator], dict]
    positive: tuple[str, ...] = ()
    also: tuple[str, ...] = ()  # names that stand for others
    robot: bool = False
    numbered: tuple[str, ...] = ()  # a1, a2, ...


CATALOGUE: dict[str, Entry] = {
    "viscous": Entry(("Fv",), lambda s, j, z, r: {"Fv": z * r.uniform(0.4, 0.8) * s.viscous[j]}),
    "coulomb": Entry(("Fc",), lambda s, j, z, r: {"Fc": z * r.uniform(0.4, 0.8) * s.coulomb[j]}),
    "asymmetric_coulomb": Entry(("dF",), lambda s, j, z, r: {"dF": z * r.uniform(0.5, 0.9) * s.coulomb[j] * _sign(r)}),
    "asymmetric_viscous": Entry(("dFv",), lambda s, j, z, r: {"dFv": z * r.uniform(0.5, 0.9) * s.viscous[j] * _sign(r)}),
    "stribeck": Entry(
        ("dF", "vs"), lambda s, j, z, r: {"dF": z * r.uniform(0.6, 1.2) * s.coulomb[j], "vs": r.uniform(0.04, 0.10) * s.speed[j]}, ("dF", "vs")
    ),
    "quadratic_drag": Entry(("c",), lambda s, j, z, r: {"c": z * r.uniform(0.08, 0.15) * s.torque[j] / s.speed[j] ** 2}, ("c",)),
    "sublinear_viscous": Entry(
        ("Fa", "a"),
        lambda s, j, z, r: (lambda a: {"Fa": z * r.uniform(0.08, 0.15) * s.torque[j] / s.speed[j] ** a, "a": a})(r.uniform(0.35, 0.6)), ("Fa", "a"),
    ),
    "presliding": Entry(
        ("F", "x0", "share"), lambda s, j, z, r: {"F": z * r.uniform(0.7, 1.2) * s.coulomb[j], "x0": r.uniform(0.01, 0.03) * s.reach[j], "share": 0.0},
        ("F", "x0", "s0"), also=("s0",),
    ),
    "load_friction": Entry(("mu",), lambda s, j, z, r: {"mu": z * r.uniform(0.04, 0.09)}, ("mu",)),
    "directional_efficiency": Entry(("e",), lambda s, j, z, r: {"e": z * r.uniform(0.06, 0.14)}, ("e", "eta"), also=("eta",)),
    "position_friction": Entry(("a1", "b1", "a2", "b2"), _harmonics, numbered=("a", "b")),
    "warmup": Entry(("a", "T"), lambda s, j, z, r: {"a": z * r.uniform(0.5, 1.0), "T": r.uniform(0.3, 0.6) * s.duration}, ("T",)),
    "armature": Entry(("Ia",), lambda s, j, z, r: {"Ia": z * r.uniform(0.3, 0.8) * s.inertia[j]}, ("Ia",)),
    "joint_coupling": Entry(("other", "Ia", "Fv", "Fs", "Fd"), _coupling),
    "elasticity": Entry(("K", "D"), _elasticity, ("K", "D")),
    "backlash": Entry(("b",), lambda s, j, z, r: {"b": z * r.uniform(0.002, 0.004) * s.reach[j]}, ("b",)),
    "cogging": Entry(("k", "a", "phase"), _cogging, ("k",), also=("a1", "b1")),
    "torque_bias": Entry(("b",), lambda s, j, z, r: {"b": z * r.uniform(0.03, 0.07) * s.torque[j] * _sign(r)}),
    "torque_gain": Entry(("e",), lambda s, j, z, r: {"e": z * r.uniform(0.08, 0.16) * _sign(r)}),
    "torque_saturation": Entry(("limit",), lambda s, j, z, r: {"limit": s.peak[j] * max(1.0 - z * r.uniform(0.25, 0.4), 0.2)}, ("limit",), also=("reports",)),
    "current_lag": Entry(("T",), lambda s, j, z, r: {"T": z * r.uniform(0.004, 0.009)}, ("T",)),
    "delay": Entry(("d",), lambda s, j, z, r: {"d": z * r.uniform(0.004, 0.009)}, ("d",)),
    "encoder_offset": Entry(("d",), lambda s, j, z, r: {"d": z * r.uniform(0.03, 0.06) * s.reach[j] * _sign(r)}),
    "encoder_eccentricity": Entry(
        ("d", "phi"), lambda s, j, z, r: {"d": z * r.uniform(0.012, 0.03) * s.reach[j], "phi": r.uniform(0.0, 2.0 * math.pi)}
    ),
    "gravity_tilt": Entry(
        ("roll", "pitch"), lambda s, j, z, r: (lambda x, p: {"roll": x * math.cos(p), "pitch": x * math.sin(p)})(z * r.uniform(0.04, 0.08), r.uniform(0.0, 2.0 * math.pi)),
        robot=True,
    ),
    "spring": Entry(("k", "q0"), _spring),
    "cable": Entry(("c1", "c2", "c3", "c4", "c5"), _bump),
    "payload": Entry(("m", "x", "y", "z", "lx", "ly", "lz"), _payload, ("m", "lx", "ly", "lz"), robot=True),
    "external_force": Entry(
        ("force", "windows"),
        lambda s, j, z, r: {"force": z * r.uniform(0.15, 0.25) * s.force, "windows": float(max(2, round(s.duration / 6.0)))},
        ("force", "windows"), robot=True,
    ),
}  # fmt: skip


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
        close = difflib.get_close_matches(hide.joint, robot.joints, n=3, cutoff=0.5) or list(robot.joints)
        raise SysidError(f"{hide.effect}: no joint {hide.joint!r} moves", where="--hide", allowed=", ".join(close))
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
