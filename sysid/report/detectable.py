"""What these logs could have shown, and what the residual follows."""

from __future__ import annotations

from ..estimate import Fit
from ..statement.tables import size
from .verdict import left_words
from .words import SPACE, breaking, empty, percentage, quantity, raised, table, text


def detectable(fit: Fit, document: dict) -> tuple[str, str, list]:
    """The smallest sizes that these logs would have named, and what they show at no size."""
    found, joints = document["detectable"], fit.joints
    absorbed: dict[tuple[str, str], list[str]] = {}
    for entry in document["absorbed"]:
        absorbed.setdefault((entry["effect"], entry["separate_by"]), []).append(entry["joint"])
    there = {(entry["effect"], entry["joint"]): entry for entry in found}
    # "–": asked, and shown at no size; nothing: in the model already
    gone = {(entry["effect"], entry["joint"]) for entry in document["absorbed"]}

    def cell(effect: str, joint: str) -> str:
        key = (effect, joint)
        return _size(there[key]) if key in there else "–" if key in gone else ""

    on_robot = {effect for effect, joint in there if joint == "*"}
    rows = [
        [breaking(effect), *(cell(effect, joint) for joint in joints)]
        for effect in dict.fromkeys(e["effect"] for e in found)
        if effect not in on_robot
    ]
    body = ""
    if found:
        body += (
            "<p>The smallest size of each effect that these logs would have named nine times in "
            "ten, had it been there, at the values of its shape that show it best. Smaller ones may be there unseen. “–”: at no size, as other "
            "parameters take its place.</p>"
        )
    if rows:
        body += table(
            ["effect", *map(breaking, joints)],
            rows,
            "sizes",
            "smallest sizes that these logs would have named",
        )
    if whole := [f"{text(e)} {cell(e, '*')}" for e in sorted(on_robot)]:
        body += f"<p>Of the whole robot: {', '.join(whole)}.</p>"
    if absorbed:
        rows = [
            [
                breaking(effect),
                ", ".join("whole robot" if j == "*" else breaking(j) for j in own),
                text(by),
            ]
            for (effect, by), own in absorbed.items()
        ]
        heads = ["effect", "on", "the experiment that would show it"]
        body += "<h3>At no size</h3><p>Whether these are there cannot be said from these logs.</p>"
        body += table(heads, rows, "wrap", "effects that these logs show at no size")
    if not body:
        body = empty("Nothing was asked: every effect of the vocabulary is in the model.")
    return "What these logs could have shown", body + _followed(fit, document), []


def _size(entry: dict) -> str:
    unit = "" if entry["unit"] in ("", "1") else SPACE + text(raised(entry["unit"]))
    at = "".join(f", {text(name)}{SPACE}{size(value)}" for name, value in entry["at"].items())
    return f"{text(entry['parameter'])}{SPACE}{size(entry['size'])}{unit}{at}"


def _followed(fit: Fit, document: dict) -> str:
    """What the rest of each joint's residual follows."""
    body = ""
    for found in document["verdict"]:
        if "depends_on" not in found:
            continue
        rows = [
            [text(quantity(d["variable"], fit)), percentage(d["share"])]
            for d in found["depends_on"]
        ]
        joint = text(found["joint"])
        body += f"<h3>What the residual of {joint} follows</h3><p>{left_words(found, fit)}.</p>"
        body += table(
            ["variable", "share predicted"],
            rows,
            label=f"what the residual of {found['joint']} follows",
        )
    return body
