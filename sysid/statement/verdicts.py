"""The verdict on one joint, as a document has it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..addition import command, spelled
from ..diagnose.verdict import Verdict
from ..fit_document import number
from ..flexible import HUM, TOLD, Law, Unknown
from .claims import chances, confidence_set, ties
from .laws import TOGETHER
from .words import quantity


def verdict(v: Verdict, path="config.yaml", joints=()) -> dict:
    """What a document has of a verdict.

    Args:
        path: of the experiment's file, for what is typed. joints: all of the robot's.
    """
    out: dict = {"joint": v.joint, "status": v.status}
    # where all error may be noise, what falls is all that is more
    share = number(min(v.explained, 1.0)) if np.isfinite(v.explained) else None
    share = 1.0 if v.status in ("missing", "explained") and share is None else share
    if v.status in ("missing", "unknown") and v.claims:
        first = v.claims[0]
        named = {
            "effect": first.head.effect,
            "tied_with": ties(first, first.head),
            "command": first.head.command,
            "set": chances(confidence_set(first)),
            "explained": share,
        }
        also = [c.head.effect for c in v.claims[1:]]
        part = {"also": [first.head.effect, *also], "explained": named["explained"]}
        out |= {**named, "also": also} if v.status == "missing" else part
        out["commands"] = [c.head.command for c in v.claims]
    elif v.status == "unknown":
        out["also"] = []
    if v.status == "explained":
        by = [{"effect": c.head.effect, "joint": c.head.joint} for c in v.claims]
        out |= {"by": by, "explained": share}
    if v.says or v.carries:
        all_ = v.says, v.follows and _strength(v.follows), v.carries and v.carries.says
        out["says"] = "; ".join(words for words in all_ if words)
    if v.follows is not None:
        out["strength"] = {"follows": v.follows.variables, "share": float(v.follows.share)}
    if v.carries and v.carries.fails:
        out["carries_over"] = False
    if v.may is not None:
        where = v.may.where(joints) if joints else v.joint
        name, own, options = spelled(v.may, where)
        adds = command(Path(path), name, own, options)
        told = {"effect": name, "joint": where, "options": options}
        out["may_be"] = {**told, "command": adds}
    if v.even:
        out["weighting"] = "noise"
    if v.reason is not None:
        out["needs_no_log"] = True
    if v.left is not None:
        out |= {"depends_on": dependences(v.left), "share_left": v.left.share}
    elif v.status == "unknown":
        out["depends_on"] = []
    return out


def _strength(law: Law) -> str:
    return (
        "how strong what is left is, or how quickly it changes, follows "
        f"{quantity(law.variables)}: a law that these logs do not name, or noise that is louder "
        "there"
    )


def dependences(found: Unknown) -> list[dict]:
    """What a residual follows: variables with the share of its square that functions of each alone
    predict, largest first; where none does, all of them together."""
    alone = sorted((share, name) for name, share in found.shares.items() if share > TOLD)[::-1]
    out = [
        {"variable": name, **({"with": other} if other else {}), "share": float(share)}
        | ({"hertz": found.hertz} if name == HUM else {})
        for share, words in alone[:4]
        for name, _, other in [words.partition(" and ")]
    ]
    return out or [{"variable": TOGETHER, "share": found.share}]
