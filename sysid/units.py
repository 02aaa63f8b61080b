"""Units of a log, converted once, where it is read; and the names of units for prismatic joints."""

import math
import re

TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
DEGREE = round(math.pi / 180.0, 8)  # rad, as an experiment file says it
POSITION = {"rad": 1.0, "m": 1.0, "deg": math.pi / 180.0, "mm": 1e-3}
TORQUE = {"N m": 1.0, "N": 1.0, "A": 1.0}  # A is multiplied by the joint's torque constant


#: {quantity: {word: unit}}
WORDS = {
    "time": {"s": "s", "sec": "s", "secs": "s", "seconds": "s", "second": "s", "ms": "ms"}
    | {"msec": "ms", "millis": "ms", "milliseconds": "ms", "us": "us", "usec": "us", "micros": "us"}
    | {"microseconds": "us", "ns": "ns", "nsec": "ns", "nanos": "ns", "nanoseconds": "ns"},
    "position": {"deg": "deg", "degree": "deg", "degrees": "deg", "rad": "rad", "rads": "rad"}
    | {"radian": "rad", "radians": "rad", "mm": "mm", "m": "m"},
    "torque": {"nm": "N m"},
}
# what brackets in a header say beside these; units that no log may be in stand for themselves
_SYMBOLS = {
    "time": {"µs": "us", "min": "min"},
    "position": {"°": "deg", "cm": "cm", "rev": "rev", "turns": "turns", "mrad": "mrad"},
    "torque": {"n": "N", "a": "A", "amp": "A", "amps": "A", "ma": "mA", "mnm": "mN m", "ncm": "N cm", "knm": "kN m", "kn": "kN"},
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
    said = re.sub(r"[\s.*·⋅]", "", found[1].lower())
    if quantity == "position":
        said = re.sub(r"(/s|/s\^?2|/s²)$", "", said)
    return (WORDS[quantity] | _SYMBOLS[quantity]).get(said, "")


def is_unit(word: str) -> bool:
    """Whether a word alone names a unit of any quantity of a log, "deg" or "rad/s"."""
    return any(in_header(f"[{word.strip('[]()')}]", quantity) for quantity in WORDS)


def agree(stated: str, taken: str) -> bool:
    """Whether numbers in one unit may be read in another: the same, or, as one unit is named for turning and for sliding
    joints, the other kind's own of which 1 is 1 (rad and m, N m and N)."""
    scales = POSITION if taken in POSITION else TORQUE if taken in TORQUE else TIME
    kind = (("rad", "deg"), ("m", "mm"), ("N m",), ("N",), ("A",), ("s", "ms", "us", "ns"))
    alike = any(stated in units and taken in units for units in kind)
    return stated == taken or (not alike and stated != "A" and taken != "A" and scales.get(stated) == 1.0)


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
