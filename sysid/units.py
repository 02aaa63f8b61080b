"""Units of a log, converted once, where it is read; and the names of units for prismatic joints."""

import math
import re

import numpy as np

TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
DEGREE = round(math.pi / 180.0, 8)  # rad, as an experiment file says it
#: what an angle may be in, and a length
ANGLES = {"rad": 1.0, "deg": math.pi / 180.0, "turns": 2.0 * math.pi}
POSITION = {"m": 1.0, "mm": 1e-3, **ANGLES}
_FORCES = {"N": 1.0, "mN": 1e-3, "kN": 1e3}
_TORQUES = {"N m": 1.0, "mN m": 1e-3, "N cm": 1e-2, "kN m": 1e3}
_FAR, _SLACK = 10.0, 0.1  # of the way between a joint's limits
TORQUE = _TORQUES | _FORCES | {"A": 1.0}  # A is multiplied by the joint's torque constant


#: {quantity: {word: unit}}
WORDS = {
    "time": {"s": "s", "sec": "s", "secs": "s", "seconds": "s", "second": "s", "ms": "ms"}
    | {"msec": "ms", "millis": "ms", "milliseconds": "ms", "us": "us", "usec": "us", "micros": "us"}
    | {"microseconds": "us", "ns": "ns", "nsec": "ns", "nanos": "ns", "nanoseconds": "ns"},
    "position": {"deg": "deg", "degree": "deg", "degrees": "deg", "rad": "rad", "rads": "rad"}
    | {"radian": "rad", "radians": "rad", "mm": "mm", "m": "m"}
    | {"rev": "turns", "revs": "turns", "revolutions": "turns", "turn": "turns", "turns": "turns"},
    "torque": {"nm": "N m"},
}
# what brackets in a header say beside these; units that no log may be in stand for themselves
_SYMBOLS = {
    "time": {"µs": "us", "min": "min"},
    "position": {"°": "deg", "cm": "cm", "mrad": "mrad"},
    "torque": {"n": "N", "a": "A", "amp": "A", "amps": "A", "ma": "mA", "mnm": "mN m", "ncm": "N cm", "knm": "kN m", "kn": "kN", "mn": "mN"},
}
_BRACKETS = re.compile(r"[\[(]([^\[\]()]*)[\])]\s*$")


def in_header(name: str, quantity: str) -> str:
    """The unit that a column's name states in brackets at its end, "angle [deg]"; empty where it states none that is known.

    Args:
        quantity: time, position (also of a speed or an acceleration, a unit of position over s), or torque.
    """
    found = _BRACKETS.search(name)
    if found is None:
        return ""
    if re.match(r"\s*M[Nn]", found[1]):
        return found[1].strip()  # mega is no milli
    said = re.sub(r"[\s.*·⋅]", "", found[1].lower())
    if quantity == "position":
        said = re.sub(r"(/s|/s\^?2|/s²)$", "", said)
    return (WORDS[quantity] | _SYMBOLS[quantity]).get(said, "")


def is_unit(word: str) -> bool:
    """Whether a word alone names a unit of any quantity of a log, "deg" or "rad/s"."""
    return any(in_header(f"[{word.strip('[]()')}]", quantity) for quantity in WORDS)


def scales(unit: str, prismatic) -> np.ndarray:
    """What makes SI units of logged numbers (dof,) of joints, turning and sliding (dof,) ones, in a unit of position or of torque: one unit is
    named for all, an angle (a torque) for those that turn, a length (a force) for those that slide; the others' numbers are SI."""
    own = (POSITION | TORQUE)[unit]
    slides, both = unit in ("m", "mm") or unit in _FORCES, unit == "A"
    return np.where(np.asarray(prismatic) == slides, own, 1.0) if not both else np.ones(len(prismatic))


def in_millimetres(values, low: float, high: float) -> bool:
    """Whether a sliding joint's positions (n,) go far beyond its limits [m], and as mm not at all."""
    values, span = np.asarray(values), high - low
    if not (np.isfinite(span) and span > 0.0):
        return False
    far, near = (max(low - s * values.min(), s * values.max() - high) for s in (1.0, 1e-3))
    return far > _FAR * span and near < _SLACK * span


def agree(stated: str, taken: str) -> bool:
    """Whether numbers in one unit may be read in another: the same, or, as one unit is named for turning and for sliding
    joints, the other kind's own of which 1 is 1 (rad and m, N m and N)."""
    known = POSITION if taken in POSITION else TORQUE if taken in TORQUE else TIME
    kind = (tuple(ANGLES), ("m", "mm"), tuple(_TORQUES), tuple(_FORCES), ("A",), tuple(TIME))
    alike = any(stated in units and taken in units for units in kind)
    return stated == taken or (not alike and stated != "A" and taken != "A" and known.get(stated) == 1.0)


def of_joint(unit: str, *, prismatic: bool) -> str:
    """A unit written for a revolute joint, as it reads on a prismatic one: N m -> N, rad -> m, kg m^2 -> kg."""
    if not prismatic:
        return unit
    for revolute, linear in (("kg m^2", "kg"), ("N m", "N"), ("rad", "m")):
        unit = unit.replace(revolute, linear)
    return unit


def behind(unit: str, shown: str = " {}") -> str:
    """What stands behind a number or a name for its unit: nothing where it has none. shown: how, about the unit's place."""
    return "" if unit in ("", "1") else shown.format(unit)
