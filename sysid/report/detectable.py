"""What these logs could have shown, and what the residual follows."""

from __future__ import annotations

from ..estimate import Fit
from ..statement.sizes import possible, size
from ..statement.words import followed
from .left import left_words
from .section import Section
from .words import SPACE, percentage, quantity, unit_of


def detectable(fit: Fit, document: dict) -> Section:
    """The smallest sizes that these logs would have named, and what they show at no size."""
    found, joints = document["detectable"], fit.joints
    absorbed: dict[tuple[str, str], list[str]] = {}
    named = {(f["effect"], f["joint"]) for f in document["findings"] if f["joins_as_step"]}
    # what is named was seen with others in the model that took its place before
    for entry in (e for e in document["absorbed"] if (e["effect"], e["joint"]) not in named):
        absorbed.setdefault((entry["effect"], entry["separate_by"]), []).append(entry["joint"])
    there = {(entry["effect"], entry["joint"]): entry for entry in found}
    # "–": asked, and shown at no size; nothing: in the model already
    gone = {(entry["effect"], entry["joint"]) for entry in document["absorbed"]}

    def cell(effect: str, joint: str) -> str:
        key = (effect, joint)
        if key in there and possible(there[key]):
            return _size(there[key])
        return "–" if key in there or key in gone else ""

    on_robot = {effect for effect, joint in there if joint == "*"}
    values = {
        "asked": bool(found),
        "heads": ["effect", *joints],
        "sizes": [
            [effect, *(cell(effect, joint) for joint in joints)]
            for effect in dict.fromkeys(e["effect"] for e in found)
            if effect not in on_robot
        ],
        "whole": [f"{e} {cell(e, '*')}" for e in sorted(on_robot)],
        "absorbed": [
            {"effect": effect, "joints": ["whole robot" if j == "*" else j for j in own], "by": by}
            for (effect, by), own in absorbed.items()
        ],
        "followed": _followed(fit, document),
    }
    return Section("What these logs could have shown", "detectable", values)


def _size(entry: dict) -> str:
    at = "".join(
        f", {name}{SPACE}{size(value)}{unit_of(entry['at_units'][name])}"
        for name, value in entry["at"].items()
    )
    return f"{entry['parameter']}{SPACE}{size(entry['size'])}{unit_of(entry['unit'])}{at}"


def _followed(fit: Fit, document: dict) -> list[dict]:
    """What the rest of each joint's residual follows."""
    return [
        {
            "joint": found["joint"],
            "words": left_words(found, fit),
            "shares": [
                (followed(d, lambda v: quantity(v, fit)), percentage(d["share"]))
                for d in found["depends_on"]
            ],
        }
        for found in document["verdict"]
        if "share_left" in found
    ]
