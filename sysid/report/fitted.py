"""What the model does to the logs: measured against predicted, the error over the steps, and where it fails."""

from __future__ import annotations

import math

import numpy as np

from ..diagnose.diagnosis import Diagnosis
from ..estimate import Fit
from ..events import WORDS
from . import charts
from .words import SPACE, breaking, drawing, empty, level, number, percentage, plus_minus, raised, table, text, units

_KEY = '<span class="key"><i class="line"></i>held-out RMS error</span> <span class="key"><i class="floor"></i>noise floor ± 2 standard errors</span>'
_KEY_AHEAD = _KEY + ' <span class="key"><i class="broken"></i>expected by the diagnosis; steps in brackets are not made</span>'



def torque(fit: Fit, document: dict) -> tuple[str, str, list]:
    """Measured and predicted torque of each joint, train and test, and what disturbed the logs.

    Args:
        document: of the diagnosis.
    """
    parts = {part: fit.predictions[part] for part in ("train", "test") if part in fit.predictions}
    names = {part: _log_names(fit, part) for part in parts}
    line = charts.timeline({part: (p.log, p.t, names[part]) for part, p in parts.items()})
    drawn, unit = [], units(fit)
    for j, joint in enumerate(fit.joints):
        series = {}
        for part, prediction in parts.items():
            residual = prediction.measured[:, j] - prediction.predicted[:, j]
            if prediction.use is not None:
                residual = np.where(prediction.use[:, j], residual, np.nan)
            series[part] = (prediction.measured[:, j], prediction.predicted[:, j], residual)
        disturbed = [span for event in document["events"] if joint in event["joints"] for span in _placed(event, line)]
        drawn.append(charts.torque(f"torque{j}", joint, unit[joint][0], line, series, len(fit.joints), disturbed))
    errors = {part: p.errors() for part, p in parts.items()}
    rows = [
        [breaking(joint), *(f"{level(errors[part]['rms'][j])}{SPACE}{raised(unit[joint][0])}" for part in parts), *(_percent(errors[part]["relative_error"][j]) for part in parts)]
        for j, joint in enumerate(fit.joints)
    ]
    listed = table(["joint", *(f"RMS, {part}" for part in parts), *(f"relative error, {part}" for part in parts)], rows, label="errors of each joint")
    tools = (
        '<div class="tools" role="group" aria-label="time axis of all joints"><button type="button" data-time="in">zoom in</button><button type="button" data-time="out">zoom out</button>'
        '<button type="button" data-time="back">←<span class="only-read"> earlier</span></button><button type="button" data-time="on">→<span class="only-read"> later</span></button>'
        '<button type="button" data-time="all">whole</button></div>'
    )
    spans = [
        f"{part}: {text(_short_name(name))} from {number(begin, 3)} s" + (f" (its own clock says {number(low, 4)} s there)" if abs(low - begin) > 0.05 else "")
        for part, own in line.items() for (begin, _, name), low in zip(own["spans"], own["starts"])
    ]  # fmt: skip
    where = f'<p class="quiet">Tinted: test logs, which the fit never saw. All joints share the time axis. Long logs are thinned for display; every peak is kept. On the axis: {"; ".join(spans[:12])}{"; …" if len(spans) > 12 else ""}.</p>'
    where += _events(document["events"])
    return "Measured and predicted", listed + where + tools + "".join(f"<h3>{text(joint)}</h3>{drawing(c)}" for joint, c in zip(fit.joints, drawn)), drawn


def _percent(value) -> str:
    return "–" if value is None or not math.isfinite(value) else f"{number(100 * value, 3)}{SPACE}%"


def _log_names(fit: Fit, part: str) -> list[str]:
    return [str(entry.get("log", f"log {k + 1}")) for k, entry in enumerate(e for e in fit.logs if e.get("part") == part)]


def _short_name(name: str) -> str:
    return name.rpartition("/")[2]


def _placed(event: dict, line: dict) -> list[tuple[float, float]]:
    """Where an event stands on the axis of all logs laid end to end; none where its log has no row there."""
    out = []
    for own in line.values():
        for (begin, end, name), first in zip(own["spans"], own["starts"]):
            low, high = (begin + event[key] - first for key in ("start", "stop"))
            if name == event["log"] and high >= begin and low <= end:
                out.append((max(low, begin), min(high, end)))
    return out


def _events(found: list[dict]) -> str:
    """What disturbed the logs, as a list that opens."""
    if not found:
        return ""
    rows = [
        [
            WORDS.get(e["kind"], text(e["kind"])), breaking(e["log"]),
            f"{number(e['start'])} to {number(e['stop'])}{SPACE}s", ", ".join(map(breaking, e["joints"])),
        ]
        for e in found
    ]  # fmt: skip
    count = {kind: sum(e["kind"] == kind for e in found) for kind in dict.fromkeys(e["kind"] for e in found)}
    said = ", ".join(f"{n} {WORDS.get(kind, text(kind))}{'s' if n > 1 else ''}" for kind, n in count.items())
    kept = "left out, but for flat tops" if "saturation" in count else "left out"
    heads = ["event", "log", "its own clock", "joints"]
    return (
        f'<details class="events"><summary>{said} in these logs, shaded below; {kept}</summary>'
        f"{table(heads, rows, 'wrap', 'events in the logs')}</details>"
    )


# ---- the staircase



def steps(fit: Fit, diagnosis: Diagnosis, document: dict, history: list[dict]) -> tuple[str, str, list]:
    """The held-out error of each joint over the steps, against its noise floor."""
    now, unit = {joint: entry["rms"]["test"] for joint, entry in document["joints"].items()}, units(fit)
    usable = [s for s in history if isinstance(s.get("rms_test"), dict)]
    done = usable or [{"added": None, "joint": None, "rms_test": now}]
    same = all(_close(done[-1]["rms_test"].get(joint), rms) for joint, rms in now.items())
    ahead = _expected(diagnosis) if same else []
    names = ["start" if s.get("added") is None else f"+ {s['added']}" + ("" if s.get("joint") in (None, "*") else f" on {s['joint']}") for s in done]
    every = names + [f"(+ {word})" for word, _ in ahead]
    if len(done) == 1 and same:
        words = "No step was made yet. "
        words += "The broken line is what comes of the effects that the diagnosis names, added one after another." if ahead else "The diagnosis names no effect to add."
    elif not same:
        begun = all(_close(done[0]["rms_test"].get(joint), rms) for joint, rms in now.items())
        words = "Steps made by <code>sysid discover</code> or <code>sysid add</code>. " + (
            "The experiment file is the start of this staircase: it stayed as it was." if begun else "The experiment was changed since the last step: its error is not the last one here."
        )
    else:
        words = "Steps made so far." + (" The broken line is what comes of what the diagnosis names next." if ahead else "")
    drawn = []
    for j, joint in enumerate(fit.joints):
        made = [s["rms_test"].get(joint) for s in done] + [None] * len(ahead)
        expected = [None] * (len(done) - 1) + [made[len(done) - 1]] + [rms[joint] for _, rms in ahead] if ahead else []
        entry = document["joints"][joint]
        drawn.append(charts.staircase(f"steps{j}", joint, unit[joint][0], _short(every, done, ahead), made, expected, entry["noise_floor"], entry["noise_floor_se"]))
    rows = [[f"{k}: {breaking(name)}", *(level(v) for v in values)] for k, (name, values) in enumerate(zip(every, [[s["rms_test"].get(j) for j in fit.joints] for s in done] + [[r[j] for j in fit.joints] for _, r in ahead]))]
    rows.append(["noise floor", *(_floor(document["joints"][j]) for j in fit.joints)])
    listed = table(["step", *(f"{breaking(j)} [{raised(unit[j][0])}]" for j in fit.joints)], rows, "steps", "held-out error after each step")
    how = "".join(f"<li>{text(j)}: {text(e['floor_detail'])}</li>" for j, e in document["joints"].items())
    return "Error against the noise floor", (
        f"<p>{words}</p>{listed}<p class='quiet'>{_KEY if not ahead else _KEY_AHEAD}</p>"
        f'<div class="grid">{"".join(drawing(c) for c in drawn)}</div><details><summary>how the noise floor was found, or why not</summary><ul>{how}</ul></details>'
    ), drawn


def _floor(entry: dict) -> str:
    return "not known" if entry["noise_floor"] is None else plus_minus(entry["noise_floor"], entry["noise_floor_se"])


def _short(every: list[str], done: list, ahead: list) -> list[str]:
    """Names of steps on an axis: whole where they are few, else their numbers."""
    return every if len(every) <= 2 else [str(k) if k < len(done) else f"({k})" for k in range(len(done) + len(ahead))]


def _close(a, b) -> bool:
    return a is not None and b is not None and math.isclose(a, b, rel_tol=1e-9)


def _expected(diagnosis: Diagnosis) -> list[tuple[str, dict[str, float]]]:
    """What comes of the effects that are claimed, added one after another: [(what is added, {joint: held-out RMS})]."""
    where = lambda head: head.effect + ("" if head.joint == "*" else f" on {head.joint}")  # noqa: E731
    return [(where(claim.head), claim.after.rms("test")) for claim in diagnosis.claims]


# ---- where it fails



def failures(fit: Fit, document: dict) -> tuple[str, str, list]:
    """The residual of each joint over angle and speed, over time, over frequency, with the words."""
    drawn, parts, unit = [], [], units(fit)
    cutoff = document["low_pass"]["cutoff_hz"]
    for j, entry in enumerate(document["fails_where"]):
        joint = entry["joint"]
        force, base = unit[joint]
        own = [
            charts.residual_map(f"map{j}", joint, force, base, entry["map"]),
            charts.residual_time(f"time{j}", joint, force, entry["time"]),
            charts.residual_bands(f"bands{j}", joint, entry["frequency"]),
        ]
        drawn += own
        where = "angle" if base == "rad" else "position"
        words = "".join(f"<li>{_region(region, where)}</li>" for region in entry["regions"])
        said = f"<ul>{words}</ul>" if words else f'<p class="quiet">The error is spread evenly: no stretch of {where}, speed or time holds much more than its share.</p>'
        share = f"{percentage(entry['share_of_error'])} of the robot’s squared error, in units of each joint’s noise"
        parts.append(f'<h3>{text(joint)} <span class="quiet">{share}</span></h3>{said}<div class="grid three">{"".join(drawing(c) for c in own)}</div>')
    if not parts:
        return "Where it fails", empty("The test logs were not questioned."), []
    about = f'<p class="quiet">Test logs, times by their own clock. Map and time: below {number(cutoff, 3)} Hz, where the model is questioned. Frequency: the whole residual. In the map, grey cells were never visited.</p>'
    return "Where it fails", about + "".join(parts), drawn


def _region(found: dict, where: str) -> str:
    """Where much of the error is, as a sentence of HTML; the angle of a joint that slides is a position."""
    what = {"q": where, "qd": "speed"}.get(found["variable"], text(found["variable"]))
    span = f"{number(found['low'], 3)} to {number(found['high'], 3)}{SPACE}{text(raised(found['unit']))}"
    return f"{percentage(found['share_of_error'])} of the squared error lies in the {percentage(found['share_of_rows'])} of the rows with {what} {span}"
