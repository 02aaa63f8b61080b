"""What became of each hidden effect, and the intervals of what was counted."""

from __future__ import annotations

import math

from .claims import steps_on
from .hidden import ABSORBED

VISIBLE = 0.10  # of the held-out RMS
WITHIN = 0.05  # of the true model's held-out RMS
EXPLAINED = 0.80  # of the misfit
NAMED = ("alone", "head of family")
#: what can become of a hidden effect, best first
CATEGORIES = (
    *NAMED,
    "in family, not head",
    "named among also",
    "wrong",
    "unknown",
    "unresolved",
    "missed",
    "error",
)
MEANS = {
    "alone": "the verdict on its joint is this effect, tied with none", "head of family": "the verdict, and tied with others",
    "in family, not head": "tied with the verdict, which is another", "named among also": "a later step on the joint, after a wrong one",
    "wrong": "the verdict is another effect", "unknown": "structure that nothing explains",
    "unresolved": "error above the floor, and the log does not say why", "missed": "the joint is called complete", "error": "a crash",
}  # fmt: skip


def category(record: dict, effect: str, joint: str, others: set[str]) -> tuple[str, str]:
    """What became of an effect hidden on a joint, and the effect that was named there (or unknown, or complete).

    Args:
        others: effects hidden on the same joint, or in the whole robot; a verdict that names them is passed over.
    """
    (verdict,) = [v for v in record["verdict"] if v["joint"] == joint]
    steps = steps_on(record, joint)
    left = [s for s in steps if s["effect"] == effect or s["effect"] not in others]
    if left:
        head, *later = left
        if head["effect"] == effect:
            return ("head of family" if head["tied_with"] else "alone"), effect
        if effect in head["tied_with"]:
            return "in family, not head", head["effect"]
        return (
            "named among also"
            if any(effect in (s["effect"], *s["tied_with"]) for s in later)
            else "wrong"
        ), head["effect"]
    if any(effect in s["tied_with"] for s in steps):
        return "in family, not head", steps[0]["effect"]
    if verdict["status"] in (
        "unresolved",
        "explained",
    ):  # explained: by an effect of another joint's equation
        return ("unresolved" if verdict["status"] == "unresolved" else "missed"), verdict["status"]
    return (
        ("unknown", "unknown")
        if verdict["status"] == "unknown" or (steps and "share_left" in verdict)
        else ("missed", "complete")
    )


def score(record: dict) -> list[dict]:
    """A row for each hidden effect of a record."""
    rows = []
    for k, entry in enumerate(record["hidden"]):
        effect, joint = entry["effect"], entry["joint"]
        rms, row = (
            record["rms"],
            {
                "key": record["key"],
                "robot": record["robot"],
                "kind": record["kind"],
                "effect": effect,
                "joint": joint,
                "size": entry["size"],
            },
        )
        base = rms["without"][k] if "without" in rms else rms.get("before")
        if "true" in rms and base is not None:
            # a joint that stands still on the test logs, or is braked, has no error there
            lowered = {j: 1.0 - rms["true"][j] / base[j] if base[j] > 0.0 else 0.0 for j in base}
            joint = max(lowered, key=lowered.get) if joint == "*" else joint
            # what no model predicts on another log is not visible, whatever the log without it says
            row |= {
                "joint": joint,
                "lowered": lowered[joint],
                "visible": 0.0 < base[joint]
                and rms["true"][joint] <= (1.0 - VISIBLE) * base[joint]
                and effect not in ABSORBED,
            }
        else:
            # a crash counts against us; where the simulator made no log there is nothing to see
            row |= {"lowered": None, "visible": (record["error"] or {}).get("stage") != "simulate"}
        if record["error"] is not None:
            rows.append(row | {"category": "error", "named": "error", "extra": [], "innocent": []})
            continue
        others = {
            h["effect"]
            for i, h in enumerate(record["hidden"])
            if i != k and (h["joint"] in (joint, "*") or entry["joint"] == "*")
        }
        places = (
            [joint]
            if entry["joint"] != "*"
            else [joint, *(v["joint"] for v in record["verdict"] if v["joint"] != joint)]
        )
        found = [category(record, effect, place, others) for place in places]
        best = min(
            (c for c in found if c[0] in CATEGORIES[:4]),
            key=lambda c: CATEGORIES.index(c[0]),
            default=found[0],
        )
        guilty = {h["joint"] for h in record["hidden"]}
        row |= {
            "category": best[0], "named": best[1], "before": rms["before"][joint], "after": rms["after"][joint], "true": rms["true"][joint],
            "extra": [s["effect"] for s in steps_on(record, joint) if s["effect"] not in {effect, *others}],
            "innocent": [] if "*" in guilty else [v["joint"] for v in record["verdict"] if v["status"] == "missing" and v["joint"] not in guilty],
            "within": rms["after"][joint] <= (1.0 + WITHIN) * rms["true"][joint],
        }  # fmt: skip
        if "plain" in rms:
            row["hurts"] = (
                1.0 - rms["plain"][joint] / rms["before"][joint]
                if rms["before"][joint] > 0.0
                else 0.0
            )
        if record["kind"] == "outside":
            misfit = rms["before"][joint] ** 2 - rms["true"][joint] ** 2
            removed = (
                (rms["before"][joint] ** 2 - rms["after"][joint] ** 2) / misfit
                if misfit > 0
                else None
            )
            (verdict,) = [v for v in record["verdict"] if v["joint"] == joint]
            status = verdict["status"]
            called = {"unknown": "unknown", "unresolved": "unresolved", "complete": "missed"}.get(
                status, "explained" if removed is not None and removed >= EXPLAINED else "wrong"
            )
            row |= {
                "category": called,
                "named": verdict.get("effect") or status,
                "removed": removed,
                "admits": "share_left" in verdict,
            }
        steps = steps_on(record, joint)
        row["said"] = [[step["effect"], *step["tied_with"]] for step in steps]
        rows.append(row)
    return rows


def wilson(successes: int, count: int, z: float = 1.959963984540054) -> tuple[float, float]:
    """The interval of a share that a count of successes leaves (Wilson 1927); (0, 1) where nothing was counted."""
    if count == 0:
        return 0.0, 1.0
    share = successes / count
    middle, half = (
        share + z * z / (2 * count),
        z * math.sqrt(share * (1.0 - share) / count + z * z / (4.0 * count * count)),
    )
    low, high = (middle - half) / (1 + z * z / count), (middle + half) / (1 + z * z / count)
    return 0.0 if successes == 0 else low, 1.0 if successes == count else high


def share(successes: int, count: int) -> dict:
    """A share with its interval."""
    low, high = wilson(successes, count)
    return {
        "count": successes,
        "of": count,
        "share": successes / count if count else None,
        "low": low,
        "high": high,
    }
