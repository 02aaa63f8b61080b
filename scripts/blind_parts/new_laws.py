"""Eight torque laws that the catalogue does not have, written before the method was changed.

The method is never to be changed for one of them. A maker of (a, j, i, s) gives the torque of joint
j, to overcome: i another joint, a the size, s the joint's scales: rms `torque` [N m], `inertia`
[kg m^2], top `speed` [rad/s], `coulomb` friction [N m], and `low` and `high` [rad], the angles
between which it moves. It is called once every millisecond.
"""

from __future__ import annotations

import math
from collections.abc import Callable

STEP = 1e-3  # s between two calls
_SLOW = 0.01  # of the top speed: the width in which friction changes sign


def _seal_carried_along(a, j, i, s):
    slow = _SLOW * s["speed"]

    def torque(q, qd, qdd, t, load, memory):
        # the shaft that the lip rubs on is carried along by joint i
        along = math.tanh(qd[j] / slow) * math.tanh(qd[i] / slow)
        return a * 0.8 * s["coulomb"] * (math.tanh(qd[j] / slow) + along)

    return torque


def _whipped_cable(a, j, i, s):
    whip = 0.3 * s["torque"] / s["inertia"]

    def torque(q, qd, qdd, t, load, memory):
        # a cable bundle lags by 20 ms, and hits one or the other side of its duct
        late = memory.get("late", 0.0)
        memory["late"] = late = late + (qdd[j] - late) * STEP / 0.02
        return a * 0.2 * s["torque"] * math.tanh(late / whip) * abs(qd[j]) / s["speed"]

    return torque


def _ageing_contact(a, j, i, s):
    way, young = 0.1 * (s["high"] - s["low"]), 0.02
    slow = _SLOW * s["speed"]

    def torque(q, qd, qdd, t, load, memory):
        # Dieterich 1979: the contact ages by the second, and is renewed every `way` that it slides
        age = memory.get("age", 0.1)
        memory["age"] = age = max(age + STEP * (1.0 - age * abs(qd[j]) / way), 1e-4)
        return a * 0.6 * s["coulomb"] * math.log1p(age / young) * math.tanh(qd[j] / slow)

    return torque


def _loaded_tooth(a, j, i, s):
    slow = _SLOW * s["speed"]

    def torque(q, qd, qdd, t, load, memory):
        worn = 1.0 + math.sin(4.0 * q[j])  # some teeth are worn
        return a * 0.07 * abs(load[j]) * worn * math.tanh(qd[j] / slow)

    return torque


def _loose_load(a, j, i, s):
    omega, damping = 2.0 * math.pi * 2.0, 0.15
    inertia = min(0.15 * a, 0.4) * s["inertia"]

    def torque(q, qd, qdd, t, load, memory):
        # a load that swings behind the link: 2 Hz, little damped
        x, v = memory.get("x", q[j]), memory.get("v", qd[j])
        push = omega**2 * (q[j] - x) + 2.0 * damping * omega * (qd[j] - v)
        memory["v"] = v = v + STEP * push
        memory["x"] = x + STEP * v
        return inertia * push

    return torque


def _heat(a, j, i, s):
    slow = _SLOW * s["speed"]

    def torque(q, qd, qdd, t, load, memory):
        # grease thins with the work of the last two seconds
        heat = memory.get("heat", 0.0)
        memory["heat"] = heat = heat + STEP / 2.0 * ((qd[j] / s["speed"]) ** 2 - heat)
        return a * 0.2 * s["torque"] / (1.0 + 12.0 * heat) * math.tanh(qd[j] / slow)

    return torque


def _bumper(a, j, i, s):
    start, room = s["low"] + 0.6 * (s["high"] - s["low"]), 0.4 * (s["high"] - s["low"])

    def torque(q, qd, qdd, t, load, memory):
        # Hunt & Crossley 1975: a soft stop on one side, that never pulls
        deep = max(q[j] - start, 0.0) / room
        return a * 0.3 * s["torque"] * deep**1.5 * max(1.0 + 1.5 * qd[j] / s["speed"], 0.0)

    return torque


def _gas_strut(a, j, i, s):
    def torque(q, qd, qdd, t, load, memory):
        # a gas strut across two joints: its pressure by its length, its arm by their angles
        angle = q[j] + 0.7 * q[i] + 0.5
        length = math.sqrt(1.5 + math.cos(angle))
        return a * 0.2 * s["torque"] * math.sin(angle) / length**2.4

    return torque


#: (equation, maker)
NEW: dict[str, tuple[str, Callable]] = {
    "seal_carried_along": ("a (1 + sign qd_i) sign qd_j", _seal_carried_along),
    "whipped_cable": ("a abs(qd_j) tanh(qdd_j / w), late by 20 ms", _whipped_cable),
    "ageing_contact": (
        "a log(1 + age / 0.02 s) sign qd_j, age' = 1 - age abs(qd_j) / d",
        _ageing_contact,
    ),
    "loaded_tooth": ("a abs(load_j) (1 + sin 4 q_j) sign qd_j", _loaded_tooth),
    "loose_load": ("a (w^2 (q_j - x) + c (qd_j - x')), x'' the same without a", _loose_load),
    "heat": ("a sign qd_j / (1 + 12 h), h' = (qd_j^2 / v^2 - h) / 2 s", _heat),
    "bumper": ("a max(q_j - q_0, 0)^1.5 max(1 + c qd_j, 0)", _bumper),
    "gas_strut": ("a sin(x) / (1.5 + cos x)^1.2, x = q_j + 0.7 q_i + 0.5", _gas_strut),
}
