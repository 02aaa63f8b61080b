"""What changed on a log, as a JSON document of the same form as a diagnosis."""

from __future__ import annotations

from ..changes import Changed
from ..results import number


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
        "findings": [
            {
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
            for c in found.changes
        ],
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
