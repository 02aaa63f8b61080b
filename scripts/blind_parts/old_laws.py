"""Eight torque laws that the catalogue does not have; they were known while the method was tuned.

A maker of (a, j, i, s) gives the torque of joint j, to overcome: i another joint, a the size, s the
joint's scales.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def _product(a, j, i, s):
    return lambda q, qd, qdd, t, load, memory: a * 0.1 * s["torque"] * q[j] * q[i]


def _friction_by_other_angle(a, j, i, s):
    slow = 0.01 * s["speed"]
    return lambda q, qd, qdd, t, load, memory: (
        a * s["coulomb"] * (1.0 + np.sin(2.0 * q[i])) * np.tanh(qd[j] / slow)
    )


def _dead_zone_drag(a, j, i, s):
    free = 0.4 * s["speed"]
    return lambda q, qd, qdd, t, load, memory: (
        a * 0.4 * s["torque"] / s["speed"] * max(abs(qd[j]) - free, 0.0) * np.sign(qd[j])
    )


def _speed_ripple(a, j, i, s):
    return lambda q, qd, qdd, t, load, memory: (
        a * 0.15 * s["torque"] / s["speed"] * np.sin(5.0 * q[j]) * qd[j]
    )


def _turning_inertia(a, j, i, s):
    share = min(0.2 * a, 0.5)  # of the joint's inertia: more would make it negative
    return lambda q, qd, qdd, t, load, memory: share * s["inertia"] * np.cos(3.0 * q[j]) * qdd[j]


def _hum(a, j, i, s):
    return lambda q, qd, qdd, t, load, memory: (
        a * 0.06 * s["torque"] * np.sin(2.0 * np.pi * 7.0 * t)
    )


def _other_speed(a, j, i, s):
    return lambda q, qd, qdd, t, load, memory: (
        a * 0.25 * s["torque"] / s["speed"] ** 2 * qd[i] * abs(qd[j])
    )


def _creep(a, j, i, s):
    def torque(q, qd, qdd, t, load, memory):
        # a spring and a damper in a row, 0.4 s: it remembers
        late = memory.get("late", 0.0)
        memory["late"] = late + (qd[j] - late) * 1e-3 / 0.4
        return a * 0.2 * s["torque"] / s["speed"] * memory["late"]

    return torque


#: (equation, maker)
OLD: dict[str, tuple[str, Callable]] = {
    "product": ("a q_j q_i", _product),
    "friction_by_other_angle": ("a (1 + sin 2 q_i) sign qd_j", _friction_by_other_angle),
    "dead_zone_drag": ("a max(abs(qd_j) - v0, 0) sign qd_j", _dead_zone_drag),
    "speed_ripple": ("a sin(5 q_j) qd_j", _speed_ripple),
    "turning_inertia": ("a cos(3 q_j) qdd_j", _turning_inertia),
    "hum": ("a sin(2 pi 7 Hz t)", _hum),
    "other_speed": ("a qd_i abs(qd_j)", _other_speed),
    "creep": ("a times qd_j, late by a lag of 0.4 s", _creep),
}
