"""How large each hidden effect usually is, against what a joint does."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

ROBOT = "*"  # the joint of an effect of the whole robot


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
