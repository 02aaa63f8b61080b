"""A law of the user's own to begin with, of the variable that a residual follows most.

No law is known from which variable it is of, but three powers of it, with the direction of motion
where that takes part, show how much there is, and their plot what the law looks like.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from pathlib import Path

from ..addition import command
from ..flexible.functions import DIRECTION
from ..formula.text import OTHER
from .words import followed, percent

TOGETHER = "several variables together"
_MOST = 0.5  # of what functions of the motion predict: less, and another variable has more
# Of what most predict, and times what that leaves: one variable says it more simply than two.
_NEARLY, _LEAVES = 0.8, 1.5
_TRIED = 2  # of these: each is a fit
# without what nearly every model has, a constant, Coulomb and viscous friction
_TERMS = {
    "": "a*{0} + b*{0}**2 + c*{0}**3",
    DIRECTION: "a*s*{0} + b*s*{0}**2 + c*{0} + d*{0}**2",
    "other": "a*{0}*{1} + b*{0}**2*{1} + c*{0}*{1}**2 + d*{0}**2 + e*{1}**2",
}
_OF_SPEED = {
    "": "a*qd*abs(qd) + b*qd**2 + c*qd**3",
    DIRECTION: "a*s*qd**2 + b*qd**2 + c*qd**3",
    # friction, dry and viscous, that changes with something else
    "other": "a*s*{1} + b*s*{1}**2 + c*qd*{1} + d*qd*{1}**2 + e*qd**2*{1}",
}


BODIES = (
    "torque that follows the acceleration of another joint is what bodies make: an axis, a length "
    "or a zero of the robot's file may be wrong, or a body is missing there"
)


def of_bodies(entry: dict) -> bool:
    """Whether what a joint's residual follows most, as its document has it, is the acceleration of
    another joint, alone or with something else: no law of that joint."""
    most = entry.get("depends_on", ())[:1]
    said = [v for one in most for v in (one["variable"], *one.get("with", "").split(" and "))]
    return any(v.startswith("qdd_") and v != f"qdd_{entry['joint']}" for v in said)


def to_begin_with(
    entry: dict,
    path,
    there: Collection[tuple[str, str]],
    borne_out: Callable[[str, dict], bool] = lambda *_: True,
) -> dict | None:
    """{effect, joint, options, command} for a joint that is `unknown`, as its document has it.

    None where nothing that a formula may hold stands out, such a law is in the model already, or no
    fit bears one out.

    Args:
        path: of the experiment file. there: (effect, joint) of the model's. borne_out: of a joint
            and options of a formula, whether a fit with it has less error on the test logs.
    """
    joint, told = entry["joint"], entry.get("depends_on", ())
    if not told or told[0]["share"] < _MOST * entry["share_left"] or of_bodies(entry):
        return None
    most = told[0]["share"]
    near = [
        one for one in told if one["share"] >= max(_NEARLY * most, 1.0 - _LEAVES * (1.0 - most))
    ]
    every = (_options(one, joint) for one in sorted(near, key=lambda one: "with" in one))
    new = [own for own in every if own and (own["name"], joint) not in there]
    for options in new[:_TRIED]:
        if borne_out(joint, options):
            adds = command(Path(path), "formula", [joint], options)
            return {"effect": "formula", "joint": joint, "options": options, "command": adds}
    return None


def _options(told: dict, joint: str) -> dict | None:
    """Of a formula of what a residual follows; None where none may hold that."""
    variable, other = _in_formula(told["variable"], joint), told.get("with", "")
    if other and other != DIRECTION:
        other = _in_formula(other, joint)
    if variable is None or other is None:
        return None
    if other == "qd":
        variable, other = other, variable
    form, terms = other if other in _TERMS else "other", _TERMS
    if variable == "qd" and form in _OF_SPEED:
        terms = _OF_SPEED
    formula = terms[form].format(variable, other)
    name = re.sub(
        "[^a-z0-9_]", "_", "_and_".join(("law_of_" + variable, other)[: 1 + bool(other)]).lower()
    )
    return {"formula": formula, "name": name}


def _in_formula(variable: str, joint: str) -> str | None:
    """A variable of a view as a formula of a joint has it."""
    if variable == "time":
        return "t"
    kind, _, of = variable.partition("_")
    if of == joint and kind in ("q", "qd", "qdd", "load"):
        return kind
    return variable if OTHER.fullmatch(variable) else None


def predicted(entry: dict, word: Callable[[str], str], share: Callable[[float], str]) -> str:
    """What of the rest of a joint's error the motion predicts or a tone holds; empty where nothing.

    Args:
        entry: as a document has it. word, share: how a variable and a share are written.
    """
    if "share_left" not in entry:
        return ""
    if told := tone(entry):
        return told
    whole = f"the motion predicts {share(entry['share_left'])} of what is left"
    alone = [
        f"{followed(d, word)} {share(d['share'])}"
        for d in entry["depends_on"][:3]
        if d["variable"] != TOGETHER
    ]
    return whole + (f" ({', '.join(alone)})" if alone else "")


def tone(v: dict) -> str:
    """What is said of a verdict of which all that is left above the floor is a steady tone; empty
    where it is more."""
    first = next(iter(v.get("depends_on", ())), {})
    if "hertz" not in first or first["share"] < v["share_left"]:
        return ""
    return (
        f"a steady tone of {first['hertz']:.3g} Hz holds {percent(first['share'])} of what is "
        "left: a hum of the drive or the mains, or a vibration, and no function of the motion"
    )
