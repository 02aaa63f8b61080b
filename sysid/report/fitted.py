"""What the model does to the logs: measured against predicted, and where it fails."""

from __future__ import annotations

import math

from ..estimate import Fit
from ..events import WORDS, plural
from . import charts, residual_charts, torque_chart
from .section import Section
from .words import SPACE, level, number, percentage, raised, units

_MOST = 12  # logs that are listed


def torque(fit: Fit, document: dict) -> Section:
    """Measured and predicted torque of each joint, train and test, and what disturbed the logs.

    Args:
        document: of the diagnosis.
    """
    parts = {part: fit.predictions[part] for part in ("train", "test") if part in fit.predictions}
    names = {part: log_names(fit, part) for part in parts}
    line = charts.timeline({part: (p.log, p.t, names[part]) for part, p in parts.items()})
    drawn, unit, events = [], units(fit), document["events"]
    for j, joint in enumerate(fit.joints):
        series = {part: prediction.of_joint(j) for part, prediction in parts.items()}
        mine = [e for e in events if joint in e["joints"]]
        own = [span for e in mine for part in line.values() for span in placed(e, part)]
        force = unit[joint][0]
        drawn.append(
            torque_chart.torque(f"torque{j}", joint, force, line, series, len(fit.joints), own)
        )
    errors = {part: p.errors() for part, p in parts.items()}
    rows = [
        [
            joint,
            *(f"{level(errors[part]['rms'][j])}{SPACE}{raised(unit[joint][0])}" for part in parts),
            *(_percent(errors[part]["relative_error"][j]) for part in parts),
        ]
        for j, joint in enumerate(fit.joints)
    ]
    spans = [
        {
            "part": part,
            "log": name.rpartition("/")[2],
            "begin": number(begin, 3),
            "clock": number(low, 4) if abs(low - begin) > 0.05 else "",
        }
        for part, own in line.items()
        for (begin, _, name), low in zip(own["spans"], own["starts"])
    ]
    values = {
        "heads": ["joint", *(f"{w}, {part}" for w in ("RMS", "relative error") for part in parts)],
        "rows": rows,
        "spans": spans[:_MOST],
        "more": len(spans) > _MOST,
        "events": [_event(e) for e in events],
        "counted": _counted(events),
        "flat": any(e["kind"] == "saturation" for e in events),
        "joints": list(zip(fit.joints, drawn)),
    }
    return Section("Measured and predicted", "torque", values, drawn)


def _percent(value) -> str:
    if value is None or not math.isfinite(value):
        return "–"
    return f"{number(100 * value, 3)}{SPACE}%"


def log_names(fit: Fit, part: str) -> list[str]:
    """The names of a part's logs, in the order of their numbers."""
    own = [entry for entry in fit.logs if entry.get("part") == part]
    return [str(entry.get("log", f"log {k + 1}")) for k, entry in enumerate(own)]


def placed(event: dict, own: dict) -> list[tuple[float, float]]:
    """Where an event stands on the axis of a part's logs end to end; none where its log has no row.

    Args:
        own: of the part, as `charts.timeline` has it.
    """
    out = []
    for (begin, end, name), first in zip(own["spans"], own["starts"]):
        low, high = (begin + event[key] - first for key in ("start", "stop"))
        if name == event["log"] and high >= begin and low <= end:
            out.append((max(low, begin), min(high, end)))
    return out


def _event(found: dict) -> dict:
    return {
        "kind": WORDS.get(found["kind"], found["kind"]),
        "log": found["log"],
        "span": f"{number(found['start'])} to {number(found['stop'])}{SPACE}s",
        "joints": found["joints"],
    }


def _counted(found: list[dict]) -> str:
    """How many events of each kind there are."""
    count = {kind: sum(e["kind"] == kind for e in found) for kind in (e["kind"] for e in found)}
    return ", ".join(f"{n} {plural(kind, n)}" for kind, n in count.items())


def failures(fit: Fit, document: dict) -> Section:
    """Each joint's residual over angle and speed, over time, over frequency, with the words."""
    drawn, joints, unit = [], [], units(fit)
    for j, entry in enumerate(document["fails_where"]):
        joint = entry["joint"]
        force, base = unit[joint]
        own = [
            residual_charts.residual_map(f"map{j}", joint, force, base, entry["map"]),
            residual_charts.residual_time(f"time{j}", joint, force, entry["time"]),
            residual_charts.residual_bands(f"bands{j}", joint, entry["frequency"]),
        ]
        drawn += own
        where = "angle" if base == "rad" else "position"
        joints.append({
            "name": joint,
            "where": where,
            "share": percentage(entry["share_of_error"]),
            "regions": [
                *(entry["words"][:1] if entry["stretches"] else []),
                *(_region(region, where) for region in entry["regions"]),
            ],
            "charts": own,
        })  # fmt: skip
    values = {"joints": joints, "cutoff": number(document["low_pass"]["cutoff_hz"], 3)}
    return Section("Where it fails", "failures", values, drawn)


def _region(found: dict, where: str) -> str:
    """Where much of the error is, as a sentence; the angle of a joint that slides is a position."""
    what = {"q": where, "qd": "speed"}.get(found["variable"], found["variable"])
    span = f"{number(found['low'], 3)} to {number(found['high'], 3)}{SPACE}{raised(found['unit'])}"
    rows = percentage(found["share_of_rows"])
    share = percentage(found["share_of_error"])
    return f"{share} of the squared error lies in the {rows} of the rows with {what} {span}"
