"""The error over the steps: what each addition made of it, against the noise floor."""

from __future__ import annotations

import math

from ..estimate import Fit
from .section import Section
from .staircase import staircase
from .words import level, plus_minus, raised, units


def steps(fit: Fit, document: dict, history: list[dict]) -> Section:
    """The held-out error of each joint over the steps, against its noise floor."""
    now = {joint: entry["rms"]["test"] for joint, entry in document["joints"].items()}
    unit = units(fit)
    usable = [s for s in history if isinstance(s.get("rms_test"), dict)]
    done = usable or [{"added": None, "joint": None, "rms_test": now}]
    same = all(_close(done[-1]["rms_test"].get(joint), rms) for joint, rms in now.items())
    begun = all(_close(done[0]["rms_test"].get(joint), rms) for joint, rms in now.items())
    ahead = _expected(document) if same else []
    every = [_name(s) for s in done] + [f"(+ {word})" for word, _ in ahead]
    axis = _short(every, done, ahead)
    drawn = []
    for j, joint in enumerate(fit.joints):
        made = [s["rms_test"].get(joint) for s in done] + [None] * len(ahead)
        expected = (
            [None] * (len(done) - 1) + [made[len(done) - 1]] + [rms[joint] for _, rms in ahead]
        )
        floor = document["joints"][joint]
        drawn.append(
            staircase(
                f"steps{j}",
                joint,
                unit[joint][0],
                axis,
                made,
                expected if ahead else [],
                floor["noise_floor"],
                floor["noise_floor_se"],
            )
        )
    errors = [s["rms_test"] for s in done] + [rms for _, rms in ahead]
    rows = [
        [f"{k}: {name}", *(level(rms.get(j)) for j in fit.joints)]
        for k, (name, rms) in enumerate(zip(every, errors))
    ]
    rows.append(["noise floor", *(_floor(document["joints"][j]) for j in fit.joints)])
    values = {
        # changed: the experiment is not the last step's; begun: it is the first one's
        "state": "changed" if not same else "none" if len(done) == 1 else "made",
        "begun": begun,
        "ahead": bool(ahead),
        "heads": ["step", *(f"{j} [{raised(unit[j][0])}]" for j in fit.joints)],
        "rows": rows,
        "charts": drawn,
        "floors": [(j, entry["floor_detail"]) for j, entry in document["joints"].items()],
    }
    return Section("Error against the noise floor", "steps", values, drawn)


def _name(step: dict) -> str:
    if step.get("added") is None:
        return "start"
    where = "" if step.get("joint") in (None, "*") else f" on {step['joint']}"
    return f"+ {step['added']}{where}"


def _floor(entry: dict) -> str:
    if entry["noise_floor"] is None:
        return "not known"
    return plus_minus(entry["noise_floor"], entry["noise_floor_se"])


def _short(every: list[str], done: list, ahead: list) -> list[str]:
    """Names of steps on an axis: whole where they are few, else their numbers."""
    if len(every) <= 2:
        return every
    return [str(k) if k < len(done) else f"({k})" for k in range(len(done) + len(ahead))]


def _close(a, b) -> bool:
    return a is not None and b is not None and math.isclose(a, b, rel_tol=1e-9)


def _expected(document: dict) -> list[tuple[str, dict[str, float]]]:
    """What comes of the effects that are claimed, added one after another.

    Returns:
        [(what is added, {joint: held-out RMS})].
    """
    out = []
    for claim in document["claims"]:
        head = document["findings"][claim["findings"][0]]
        where = "" if head["joint"] == "*" else f" on {head['joint']}"
        out.append((head["effect"] + where, claim["rms_test_after"]))
    return out
