"""Eight torque laws more that the catalogue does not have, by somebody who had not seen the method.

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


def _usual(s):
    """Torque [N m] that a law of size 1 has about."""
    return 0.4 * s["coulomb"] + 0.1 * s["torque"]


def _eddy_sector(a, j, i, s):
    span, critical = s["high"] - s["low"], 0.25 * s["speed"]
    start = s["low"] + 0.5 * span

    def torque(q, qd, qdd, t, load, memory):
        # a copper sector enters a magnet's gap; eddy currents drag most at a speed, and less beyond
        inside, x = 0.5 * (1.0 + math.tanh((q[j] - start) / (0.06 * span))), qd[j] / critical
        return a * 2.5 * _usual(s) * inside * 2.0 * x / (1.0 + x * x)

    return torque


def _governor_shoes(a, j, i, s):
    slow, out, back = _SLOW * s["speed"], 0.5 * s["speed"], 0.15 * s["speed"]

    def torque(q, qd, qdd, t, load, memory):
        # shoes fly out against their drum when the joint is fast, and stick there until it is slow
        memory["out"] = abs(qd[j]) > (back if memory.get("out") else out)
        return a * 1.5 * _usual(s) * math.tanh(qd[j] / slow) if memory["out"] else 0.0

    return torque


def _capstan_rope(a, j, i, s):
    slow, span = _SLOW * s["speed"], s["high"] - s["low"]
    middle = s["low"] + 0.5 * span

    def torque(q, qd, qdd, t, load, memory):
        # joint i's rope winds up on joint j's drum: it slips as both turn, and Euler's law holds it
        slip = qd[j] + 0.5 * qd[i]
        return a * 0.7 * _usual(s) * math.exp(2.0 * (q[j] - middle) / span) * math.tanh(slip / slow)

    return torque


def _spindle_gyro(a, j, i, s):
    upright = s["low"] + 0.4 * (s["high"] - s["low"])

    def torque(q, qd, qdd, t, load, memory):
        # joint i swings a running spindle, that stands across its axis as far as joint j leans
        return a * 5.0 * _usual(s) * qd[i] / s["speed"] * math.sin(q[j] - upright)

    return torque


def _return_line(a, j, i, s):
    slow = _SLOW * s["speed"]

    def torque(q, qd, qdd, t, load, memory):
        # two joints send their oil back by one narrow line, which a relief valve opens to the tank
        flow = (abs(qd[j]) + abs(qd[i])) / s["speed"]
        return a * 2.0 * _usual(s) * min(flow**2, 1.0) * math.tanh(qd[j] / slow)

    return torque


def _creeping_roller(a, j, i, s):
    creep = 0.05 / s["torque"]

    def torque(q, qd, qdd, t, load, memory):
        # a roller that is not round drives by friction: on its way it creeps back under load
        x = memory.get("x", q[j])
        memory["x"] = x + STEP * (qd[j] - creep * load[j] * abs(qd[j]))
        return a * 1.4 * _usual(s) * math.sin(8.0 * x)

    return torque


def _leaking_bellows(a, j, i, s):
    span = s["high"] - s["low"]

    def torque(q, qd, qdd, t, load, memory):
        # a dust cover's air leaks out by a small hole when it is pressed; a flap lets it in again
        volume = max(1.0 - 0.6 * (q[j] - s["low"]) / span, 0.2)
        air = max(memory.get("air", volume), volume)
        pressure = air / volume - 1.0
        memory["air"] = air - STEP / 3.0 * math.sqrt(pressure)
        return a * 4.0 * _usual(s) * pressure

    return torque


def _gauge_hysteresis(a, j, i, s):
    width = 0.5 * s["torque"]
    size = min(1.2 * a * _usual(s), 0.5 * width)  # of more, a load would undo itself

    def torque(q, qd, qdd, t, load, memory):
        # the glue of a torque sensor's gauge gives, and stays as the last turn of the load left it
        middle = memory.get("middle", load[j])
        memory["middle"] = middle = min(max(middle, load[j] - width), load[j] + width)
        return size * (load[j] - middle) / width

    return torque


#: (equation, maker)
FOURTH: dict[str, tuple[str, Callable]] = {
    "eddy_sector": (
        "a (1 + tanh((q_j - q_0) / d)) x / (1 + x^2), x = qd_j / v",
        _eddy_sector,
    ),
    "governor_shoes": (
        "a sign qd_j from abs(qd_j) > v_1 until abs(qd_j) < v_0",
        _governor_shoes,
    ),
    "capstan_rope": ("a exp(2 (q_j - q_0) / d) sign(qd_j + 0.5 qd_i)", _capstan_rope),
    "spindle_gyro": ("a qd_i sin(q_j - q_0)", _spindle_gyro),
    "return_line": ("a min((abs(qd_j) + abs(qd_i))^2, v^2) sign qd_j", _return_line),
    "creeping_roller": ("a sin 8 x, x' = qd_j - c load_j abs(qd_j)", _creeping_roller),
    "leaking_bellows": (
        "a (n / V - 1), n' = -sqrt(n / V - 1) / 3 s, n at least V = 1 - c (q_j - q_0)",
        _leaking_bellows,
    ),
    "gauge_hysteresis": (
        "a (load_j - h), h dragged along as soon as it is m off",
        _gauge_hysteresis,
    ),
}
