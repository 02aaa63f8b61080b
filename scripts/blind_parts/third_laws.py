"""Eight more torque laws that the catalogue does not have, by somebody who had not seen the method.

They were written before the method was changed again, which is never to be done for one of them. A
maker of (a, j, i, s) gives the torque of joint j, to overcome: i another joint, a the size, s the
joint's scales: rms `torque` [N m], `inertia` [kg m^2], top `speed` [rad/s], `coulomb` friction
[N m], and `low` and `high` [rad], the angles between which it moves. It is called once every
millisecond.
"""

from __future__ import annotations

import math
from collections.abc import Callable

STEP = 1e-3  # s between two calls
_SLOW = 0.01  # of the top speed: the width in which friction changes sign


def _clutched_spring(a, j, i, s):
    stiffness = 0.5 * s["torque"] / (s["high"] - s["low"])
    slow = _SLOW * s["speed"]

    def torque(q, qd, qdd, t, load, memory):
        # a clutch catches a spring whenever the joint turns to bend, and lets go when it turns back
        if qd[j] > slow:
            memory["caught"] = None
        elif qd[j] < -slow and memory.get("caught") is None:
            memory["caught"] = q[j]
        caught = memory.get("caught")
        return 0.0 if caught is None else a * stiffness * (q[j] - caught)

    return torque


def _one_way_pawl(a, j, i, s):
    slow = _SLOW * s["speed"]

    def torque(q, qd, qdd, t, load, memory):
        # a pawl climbs and falls from 16 teeth a radian one way; the other way it is lifted
        x = 16.0 * q[j]
        tooth = math.sin(x) + 0.5 * math.sin(2.0 * x)
        return a * 0.15 * s["torque"] * tooth * max(math.tanh(qd[j] / slow), 0.0)

    return torque


def _shared_pump(a, j, i, s):
    def torque(q, qd, qdd, t, load, memory):
        # joint i extends and draws oil: the supply falls, and joint j has less than it asks for
        flow = max(qd[i], 0.0) / s["speed"]
        return min(0.35 * a * flow, 0.6) * load[j]

    return torque


def _stroke_cushion(a, j, i, s):
    start, room = s["low"] + 0.5 * (s["high"] - s["low"]), 0.5 * (s["high"] - s["low"])

    def torque(q, qd, qdd, t, load, memory):
        # a cylinder's end throttles what leaves it; the way back is free, by a check valve
        deep = max(q[j] - start, 0.0) / room
        return a * 2.0 * s["torque"] * deep * (max(qd[j], 0.0) / s["speed"]) ** 2

    return torque


def _swept_grease(a, j, i, s):
    slow, width = _SLOW * s["speed"], 0.02 * (s["high"] - s["low"])

    def torque(q, qd, qdd, t, load, memory):
        # grease is pushed out of where the joint has been, and flows back in two seconds
        place, left = math.floor(q[j] / width), memory.setdefault("left", {})
        if place != memory.get("place"):
            away = t - left.get(place, -math.inf)
            memory["place"], memory["level"] = place, 1.0 - math.exp(-away / 2.0)
        left[place] = t
        return a * 0.2 * s["torque"] * memory["level"] * math.tanh(qd[j] / slow)

    return torque


def _current_foldback(a, j, i, s):
    share = min(0.15 * a, 0.5)

    def torque(q, qd, qdd, t, load, memory):
        # an amplifier gives less while it is too warm, until it has cooled by a good deal
        heat = memory.get("heat", 0.0)
        memory["heat"] = heat = heat + STEP / 0.8 * ((load[j] / s["torque"]) ** 2 - heat)
        memory["less"] = less = heat > (0.8 if memory.get("less") else 1.5)
        return share * load[j] if less else 0.0

    return torque


def _reflex_twitch(a, j, i, s):
    def torque(q, qd, qdd, t, load, memory):
        # the muscle of who wears the robot, stretched quickly, twitches 80 ms later; then it rests
        quick = qd[j] > 0.3 * s["speed"]
        if quick and not memory.get("quick") and t - memory.get("since", -math.inf) > 0.4:
            memory["since"] = t
        memory["quick"] = quick
        if "since" not in memory:
            return 0.0
        x = max(t - memory["since"] - 0.08, 0.0) / 0.12
        return a * 0.3 * s["torque"] * x * math.exp(1.0 - x)

    return torque


def _rolling_ballast(a, j, i, s):
    def torque(q, qd, qdd, t, load, memory):
        # a ball in a hollow link rolls to its lower end, once two joints have tilted it enough
        tilt = q[j] + q[i] - memory.setdefault("level", q[j] + q[i])
        place, lean = memory.get("place", 0.0), math.sin(tilt)
        if abs(lean) > 0.3:
            place = min(max(place + math.copysign(STEP / 0.15, lean), -1.0), 1.0)
        memory["place"] = place
        return a * 0.2 * s["torque"] * place * math.cos(tilt)

    return torque


#: (equation, maker)
THIRD: dict[str, tuple[str, Callable]] = {
    "clutched_spring": ("a (q_j - q_c) while qd_j < 0, q_c where it last turned", _clutched_spring),
    "one_way_pawl": ("a (sin x + 0.5 sin 2 x) while qd_j > 0, x = 16 q_j", _one_way_pawl),
    "shared_pump": ("a max(qd_i, 0) load_j", _shared_pump),
    "stroke_cushion": ("a max(q_j - q_0, 0) max(qd_j, 0)^2", _stroke_cushion),
    "swept_grease": ("a (1 - exp(-T / 2 s)) sign qd_j, T since it was at q_j", _swept_grease),
    "current_foldback": (
        "a load_j from h > 1.5 until h < 0.8, h' = (load_j^2 / m^2 - h) / 0.8 s",
        _current_foldback,
    ),
    "reflex_twitch": ("a x exp(1 - x), x from 80 ms after qd_j passes v", _reflex_twitch),
    "rolling_ballast": (
        "a p cos x, p to -1 or 1 as sin x passes -0.3 or 0.3, x = q_j + q_i - c",
        _rolling_ballast,
    ),
}
