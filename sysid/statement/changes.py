"""What changed on a log, as a JSON document of the same form as a diagnosis."""

from __future__ import annotations

from ..changes import Change, Changed
from ..fit_document import number
from .words import option

# times what looks like noise, where that is not known well, or beside what changed: it is no noise
_ABOVE = 2.0


def document(found: Changed, run="") -> dict:
    """The document of `sysid diagnose --model`."""
    verdict = [_verdict(found, j) for j in range(len(found.joints))]
    return {
        "joints": {
            own["joint"]: {
                "rms": {"held": float(found.rms_held[j]), "after": float(found.rms_after[j])},
                "left_as_logged": float(found.left[j]),
                "noise_floor": found.floors[j].rms,
                "noise_floor_se": None
                if found.floors[j].std is None
                else number(found.floors[j].std),
                "floor_method": found.floors[j].method,
                "status": own["status"],
            }
            for j, own in enumerate(verdict)
        },
        "findings": [_finding(change) for change in found.changes],
        "not_visible": [],
        "verdict": verdict,
        "notices": list(found.notes),
        "run": str(run),
    }


def _verdict(found: Changed, j: int) -> dict:
    joint, floor, error = found.joints[j], found.floors[j], float(found.left[j])
    noise = floor.rms or floor.about or 0.0
    if effects := [c.effect for c in found.changes if c.joint in (joint, "*")]:
        first, *also = effects
        named = {"effect": first, "tied_with": [], "also": also}
        # under the low-pass, which lets little noise through: no row about a reversal is in it
        rest = float(found.rms_after[j]) / noise if noise else 0.0
        about = "" if floor.rms else "about "
        says = (
            f"with what changed its error is still {about}{rest:.2g} times the noise: something "
            "else did too, or it is more than small changes tell of"
        )
        more = {"says": says, "times_noise": rest} if rest > _ABOVE else {}
        return {"joint": joint, "status": "missing", **named, **more}
    if error == 0.0 or floor.reached(error):  # of a torque that is not used nothing is left
        return {"joint": joint, "status": "complete"}
    if not (floor.rms or error > _ABOVE * noise > 0.0):
        why = "so nobody can say what error is left above it"
        says = f"its noise floor is not known ({floor.detail}), {why}"
        return {"joint": joint, "status": "unresolved", "says": says, "times_noise": None}
    times, about = error / max(noise, 1e-300), "" if floor.rms else "about "
    says = (
        f"its error is {about}{times:.2g} times the noise, and no change that lasts all of the log "
        "takes it: it comes within the log, or the model does not carry over to what is new in it"
    )
    return {"joint": joint, "status": "unresolved", "says": says, "times_noise": times}


def _finding(c: Change) -> dict:
    return {
        "effect": c.effect,
        "joint": c.joint,
        "options": c.options,
        "misfit_removed": c.removed,
        "misfit_removed_se": number(c.removed_se),
        "parameters": {
            name: {"value": v, "std": number(s), "unit": u}
            for name, (v, s, u) in c.parameters.items()
        },
        "tied_with": [],
    }


def named(finding: dict) -> str:
    """A change in words: its joint, and its options where these are not the usual ones."""
    options = (f", {name} {option(value)}" for name, value in finding["options"].items())
    return f"{finding['effect']} on {finding['joint']}{''.join(options)}"


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
