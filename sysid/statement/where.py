"""Where a model fails, as documents and a terminal have it."""

from __future__ import annotations

import numpy as np

from ..end_stops import END, LAWS
from ..events import most_struck
from ..failures import Failure
from ..fit_document import number
from ..plausible import WRONG
from .words import listed, wrapped


def entry(found: Failure) -> dict:
    """What a document has of one joint."""
    return {
        "joint": found.joint,
        "share_of_error": found.share,
        "words": found.words(),
        "stretches": [
            {"log": one.log, "start": one.start, "stop": one.stop} for one in found.parts
        ],
        "regions": [
            {
                "variable": r.variable,
                "unit": r.unit,
                "low": r.low,
                "high": r.high,
                "share_of_error": r.error,
                "share_of_rows": r.rows,
                "not_in_training": r.unknown,
            }
            for r in found.regions
        ],
        "map": {key: plain(values) for key, values in found.map.items()},
        "time": {key: plain(values) for key, values in found.time.items()},
        "frequency": {key: plain(values) for key, values in found.frequency.items()},
    }


def touched(document: dict) -> list[str]:
    """The joints that are not done with whose error lies in a few stretches of time."""
    status = {v["joint"]: v["status"] for v in document["verdict"]}
    return [
        own["joint"]
        for own in document.get("fails_where", ())
        if own.get("stretches")
        and status[own["joint"]] in ("unresolved", "unknown")
        # where no training log was, time says no more than place
        and not any(_beyond(region) for region in own["regions"])
    ]


def _beyond(region: dict) -> bool:
    """Whether most of a region's error lies at angles that no training log reaches."""
    return region["variable"] == "q" and region.get("not_in_training", False)


def blind(document: dict) -> list[str]:
    """The joints whose error another log may explain, and nothing that is known now."""
    own = (v for v in document["verdict"] if v["joint"] not in document.get("unused", ()))
    open_ = (v for v in own if v["status"] == "unresolved")
    known = set((document.get("too_narrow") or {"rms": ()})["rms"])
    if touched(document) or any(WRONG in notice for notice in document.get("notices", ())):
        return []  # no log tells anything while its columns are wrong, or a push bends the others
    return [
        v["joint"]
        for v in open_
        if not {"may_be", "weighting"} & v.keys()
        and v["joint"] not in known
        and not v.get("needs_no_log")  # no other log tells more
    ]


def apart(document: dict) -> list[str]:
    """The joints that err more on the test logs than on the training logs, and nobody knows why."""
    status = ("unresolved", "unknown")
    own = (v for v in document["verdict"] if not v.get("carries_over", True))
    return [v["joint"] for v in own if v["status"] in status]


def needing(document: dict) -> str:
    """Which joints need another log, in words."""
    joints = blind(document)
    return f"{listed(joints, 'and')} need{'s' * (len(joints) == 1)} another log"


def at_end(own: dict, asked: set[tuple[str, str]] = frozenset()) -> str:
    """What may be there where half of a joint's error lies at one end of its motion; empty where it
    does not.

    Args:
        asked: what was asked of these logs, or is known of them: effects and joints.
    """
    joint = own["joint"]
    for r in own.get("regions", ()):
        edges = own["map"]["q"]
        ends = {"upper_stop": r["high"] == edges[-1], "lower_stop": r["low"] == edges[0]}
        names = [name for name, there in ends.items() if there]
        if r["variable"] != "q" or r["share_of_rows"] > END or not names:
            continue
        name, share = names[0], f"{100 * r['share_of_error']:.0f} %"
        span = f"{r['low']:.4g} to {r['high']:.4g} {r['unit']}"
        said = (
            f"{share} of the squared error of {joint} lies at the {name.partition('_')[0]} end of "
            f"its motion, {span}"
        )
        if _beyond(r):
            return (
                f"{said}, which no training log reaches: nothing was fitted there; take a training "
                "log that goes there, or a test log that does not"
            )
        if (name, joint) in asked:
            return ""
        return (
            f"{said}: an end stop, or something that it meets there, looks like that; "
            f"`sysid add EXPERIMENT formula --joint {joint} --option 'formula={LAWS[name]}' "
            f"--option name={name}` fits one"
        )
    return ""


def fails(document: dict, width: int) -> list[str]:
    """Where the joints that are not done with hold most of their error."""
    status = {v["joint"]: v["status"] for v in document["verdict"]}
    asked = {(d["effect"], d["joint"]) for d in document["detectable"]}
    out = []
    for own in document["fails_where"]:
        # what is named elsewhere, or named, is better told by its effect; the first is the sharpest
        if own["words"] and status[own["joint"]] in ("unresolved", "unknown"):
            out += wrapped(f"where {own['joint']} fails: {own['words'][0]}", width, "  ")
        if status[own["joint"]] in ("unresolved", "unknown") and (said := at_end(own, asked)):
            out += wrapped(said, width, "  ")
    if joints := touched(document):
        said = (
            "what acts for a while alone, a push, a snag, a contact, is no law of the robot: if "
            "you know of one there, leave it out, under `preprocess:` in the experiment file, and "
            "diagnose again"
        )
        out += [*wrapped(said, width, "  "), *masks(document, joints)]
    return out


def masks(document: dict, joints: list[str]) -> list[str]:
    """What an experiment file says to leave those stretches out: of all joints, as what touches an
    arm is borne by many of them."""
    spans: dict[str, list[tuple[float, float]]] = {}
    for own in document["fails_where"]:
        for one in own["stretches"] if own["joint"] in joints else ():
            spans.setdefault(one["log"], []).append((one["start"], one["stop"]))
    out = ["mask:"]
    for log, each in spans.items():
        for start, stop in _united(each):
            out.append(f"  - {{log: {log}, start: {start:.2f}, stop: {stop:.2f}}}")
    return out


def _united(spans: list[tuple[float, float]]) -> list[tuple[float, float]]:
    out: list[tuple[float, float]] = []
    for start, stop in sorted(spans):
        if out and start <= out[-1][1]:
            out[-1] = (out[-1][0], max(stop, out[-1][1]))
        else:
            out.append((start, stop))
    return out


def plain(values):
    """Arrays as lists, NaN as None."""
    array = np.asarray(values)
    return (
        [[number(v) for v in row] for row in array.tolist()]
        if array.ndim == 2
        else [number(v) for v in array.tolist()]
    )


def struck(v: dict, document: dict) -> str:
    """What to do first about a joint that is not understood and of which knocks are left out time
    and again, in words; empty where it is not so."""
    knocked = [j for e in document["events"] if e["kind"] == "knock" for j in e["joints"]]
    often = v["joint"] in most_struck(knocked, len(document["joints"]))
    if v["status"] not in ("unknown", "unresolved") or not often:
        return ""
    count = knocked.count(v["joint"])
    return (
        f"{count} knocks on it are left out: where nobody pushed, ask with `events: keep` under "
        "`preprocess:` first, as what strikes or rings there is the joint's own"
    )
