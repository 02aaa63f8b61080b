"""What `sysid check` found, in lines.

Each fault stands once with its cure, however many joints and logs have it.
"""

from __future__ import annotations

from .words import wrapped

_MENDED = "angle_wrap"
_WHOLE = 3  # places that are told one by one; of more the worst is told, and the others counted


def lines(document: dict, width: int) -> list[str]:
    """The faults of a document of `sysid check`, the gravest first, and what they amount to."""
    groups: dict[tuple[str, str], list[dict]] = {}
    for fault in document["faults"]:
        groups.setdefault((fault["severity"], fault["fault"]), []).append(fault)
    out = []
    for (severity, fault), own in groups.items():
        out.append(f"{severity}: {fault}")
        for line in _told(own):
            out += wrapped(f"  {line}", width, "    ")
        for do in dict.fromkeys(f["do"] for f in own):
            out += wrapped(f"  -> {do}", width, "     ")
    return [*out, *wrapped(_sum(list(groups), document["ok"]), width, "  ")]


def fit_can_be_made(document: dict) -> bool:
    """Whether a fit of the logs is right as they are: without an error, or where it takes angles
    that wrap to go on."""
    errors = {f["fault"] for f in document["faults"] if f["severity"] == "error"}
    return errors <= {_MENDED}


def _told(own: list[dict]) -> list[str]:
    says = list(dict.fromkeys(f["says"] for f in own))
    if len(says) <= _WHOLE:
        return says
    worst = max(own, key=lambda f: f["rows"])
    joints: dict[str, list[dict]] = {}
    for f in own:
        joints.setdefault(f["joint"] or "all joints", []).append(f)
    counted = [
        f"{joint} in {len(logs)} log{'s' * (len(logs) > 1)}"
        if (logs := {f["log"] for f in some if f["log"]})
        else joint
        for joint, some in joints.items()
    ]
    return [worst["says"], f"{len(says)} such in all: {', '.join(counted)}"]


def _sum(kinds: list[tuple[str, str]], ok: bool) -> str:
    if not kinds:
        return "no fault was found"
    wrong = {fault for severity, fault in kinds if severity == "error"}
    errors, warnings = len(wrong), len(kinds) - len(wrong)
    said = f"{warnings} kind{'s' * (warnings != 1)} of warning"
    if ok:
        return f"{said}, no error: these logs can be fitted"
    more = f" and {said}" if warnings else ""
    mended = "takes the angles to go on, and can be made"
    then = mended if wrong == {_MENDED} else "of these logs would be wrong"
    return f"{errors} kind{'s' * (errors > 1)} of error{more}: a fit {then}"
