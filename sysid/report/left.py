"""What is left of a joint's error beyond noise, in words."""

from __future__ import annotations

from ..estimate import Fit
from ..statement.laws import tone
from ..statement.words import followed
from .words import percentage, quantity


def left_words(found: dict, fit: Fit) -> str:
    """How much of what is left the motion predicts, and which variables; empty where nothing."""
    if "share_left" not in found:
        return ""
    if told := tone(found):
        return told[0].upper() + told[1:]
    alone = [
        f"{followed(d, lambda v: _named(v, fit))} {percentage(d['share'])}"
        for d in found["depends_on"][:3]
        if d["variable"] != "several variables together"
    ]
    whole = f"The motion predicts {percentage(found['share_left'])} of what is left"
    return whole + (f" ({', '.join(alone)})" if alone else "")


def _named(variable: str, fit: Fit) -> str:
    """A variable that a residual follows, escaped, with the article that a sentence needs."""
    words = quantity(variable, fit)
    return words if words == variable else f"the {words}"
