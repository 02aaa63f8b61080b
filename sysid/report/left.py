"""What is left of a joint's error beyond noise, in words."""

from __future__ import annotations

from ..estimate import Fit
from ..statement.laws import predicted
from .words import percentage, quantity


def left_words(found: dict, fit: Fit) -> str:
    """How much of what is left the motion predicts, and which variables; empty where nothing."""
    told = predicted(found, lambda variable: _named(variable, fit), percentage)
    return told[:1].upper() + told[1:]


def _named(variable: str, fit: Fit) -> str:
    """A variable that a residual follows, escaped, with the article that a sentence needs."""
    words = quantity(variable, fit)
    return words if words == variable else f"the {words}"
