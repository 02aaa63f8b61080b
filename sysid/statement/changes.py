"""What changed on a log, as a JSON document of the same form as a diagnosis."""

from __future__ import annotations

from ..changes import Change, Changed
from ..fit_document import number


def document(found: Changed, run="") -> dict:
    """The document of `sysid diagnose --model`."""
    touched = lambda joint: [c for c in found.changes if c.joint in (joint, "*")]  # noqa: E731
    return {
        "joints": {
            joint: {
                "rms": {"held": float(found.rms_held[j]), "after": float(found.rms_after[j])},
                "noise_floor": found.floors[j].rms,
                "noise_floor_se": None
                if found.floors[j].std is None
                else number(found.floors[j].std),
                "floor_method": found.floors[j].method,
                "status": "missing" if touched(joint) else "complete",
            }
            for j, joint in enumerate(found.joints)
        },
        "findings": [_finding(change) for change in found.changes],
        "not_visible": [],
        "verdict": [
            {
                "joint": joint,
                "status": "missing",
                "effect": touched(joint)[0].effect,
                "tied_with": [],
                "also": [c.effect for c in touched(joint)[1:]],
            }
            if touched(joint)
            else {"joint": joint, "status": "complete"}
            for joint in found.joints
        ],
        "notices": list(found.notes),
        "run": str(run),
    }


def _finding(c: Change) -> dict:
    return {
        "effect": c.effect,
        "joint": c.joint,
        "misfit_removed": c.removed,
        "misfit_removed_se": number(c.removed_se),
        "parameters": {
            name: {"value": v, "std": number(s), "unit": u}
            for name, (v, s, u) in c.parameters.items()
        },
        "tied_with": [],
    }


def many_document(found: dict[str, Changed], failed: dict[str, str], held, run="") -> dict:
    """The document of `sysid fleet --against`."""
    return {
        "against": str(held),
        "logs": {
            log: {
                "rms_held": dict(zip(one.joints, one.rms_held.tolist())),
                "rms_after": dict(zip(one.joints, one.rms_after.tolist())),
                "changes": [_finding(change) for change in one.changes],
                "notices": list(one.notes),
            }
            for log, one in found.items()
        },
        "failed": [{"log": log, "says": why} for log, why in failed.items()],
        "run": str(run),
    }
