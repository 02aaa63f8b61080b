"""Numbers, units and names as the words of a page, all plain texts: the templates escape them."""

from __future__ import annotations

import math
import re

from .. import filters
from ..estimate import Fit

SPACE = "\u00a0"  # between a number and what belongs to it: no line ends there


def pieces(name) -> list[str]:
    """A name in pieces that may stand on lines of their own, cut after `_`, `.` and `/`."""
    return re.split(r"(?<=\w[._/])", str(name))


def placed(effect: str, joint: str, here: str = "") -> str:
    """An effect with its joint, where that is not `here`."""
    where = "" if joint == here else " of the whole robot" if joint == "*" else f" on {joint}"
    return effect + where


def number(value, digits: int = 4) -> str:
    """A number as text; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.{digits}g}".replace("-", "−")


def level(value) -> str:
    """An error as text, always to four digits, so that levels can be compared by eye."""
    if value is None or not math.isfinite(value) or not 1e-3 <= abs(value) < 1e3:
        return number(value)
    return f"{value:#.4g}".rstrip(".").replace("-", "−")


def plus_minus(value, std, digits: int = 4) -> str:
    """A value with its standard deviation, rounded to two digits of the latter."""
    if value is None or not math.isfinite(value):
        return "–"
    if std is None or not math.isfinite(std) or std <= 0:
        return number(value, digits)
    places = 1 - int(math.floor(math.log10(std)))
    if -2 <= places <= 6 and abs(value) < 1e6:
        places = max(places, 0)
        return f"{round(value, places) + 0.0:.{places}f}{SPACE}±{SPACE}{std:.{places}f}".replace(
            "-", "−"
        )  # + 0.0: no minus before a zero
    return f"{number(value, digits)}{SPACE}±{SPACE}{number(std, 2)}"


def unit_of(word: str) -> str:
    """A unit as text behind a number; nothing where there is none."""
    return "" if word in ("", "1") else SPACE + raised(word)


def known(name: str, value, std, unit: str) -> str:
    """A parameter of an effect with its value, its standard deviation and its unit."""
    return f"{name.split('.')[-1]}{SPACE}={SPACE}{plus_minus(value, std)}{unit_of(unit)}"


def raised(unit: str) -> str:
    """A unit with its powers as they are printed, in one piece."""
    return unit.replace("^2", "²").replace("^3", "³").replace(" ", SPACE)


def quantity(variable: str, fit: Fit) -> str:
    """A variable of the diagnosis (`qd_hip`) in words; itself where it is none of the motion's."""
    for joint, slides in zip(fit.joints, fit.model.robot.prismatic):
        known = {
            "q": "position" if slides else "angle",
            "qd": "speed",
            "qdd": "acceleration",
            "load": "load",
        }
        for symbol, word in known.items():
            if variable == f"{symbol}_{joint}":
                return f"{word} of {joint}"
    return variable


def units(fit: Fit) -> dict[str, tuple[str, str]]:
    """Of each joint the unit of what it exerts and of where it is."""
    return {
        joint: ("N", "m") if slides else ("N m", "rad")
        for joint, slides in zip(fit.joints, fit.model.robot.prismatic)
    }


def band(fit: Fit) -> str:
    """The band that a fit's errors are of, in words."""
    return filters.torque_band(filters.settled(fit.experiment.preprocess, fit.filters))


def percentage(share, se=None) -> str:
    """A share, with its standard error, in per cent."""
    if share is None or not math.isfinite(share):
        return "–"
    places = 0 if abs(share) >= 0.0995 else 1
    # + 0.0: no minus before a zero
    said = [f"{round(100 * v, places) + 0.0:.{places}f}" for v in (share, se) if _finite(v)]
    return f"{f'{SPACE}±{SPACE}'.join(said)}{SPACE}%".replace("-", "−")


def _finite(value) -> bool:
    return value is not None and math.isfinite(value)


def chance(probability: float) -> str:
    """A probability, in per cent: as many draws tell it, it is never nothing."""
    return f"<{SPACE}1{SPACE}%" if probability < 0.005 else f"{round(100 * probability)}{SPACE}%"
