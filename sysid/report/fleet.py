"""The page of a fleet: which robots are odd, what differs, what is shared, how it drifts."""

from __future__ import annotations

from pathlib import Path

from .. import whole_files
from . import charts, page
from .section import Section
from .words import SPACE, level, number, percentage, plus_minus, unit_of

_SHORT = {
    "verdict": "Odd ones",
    "differs": "What differs",
    "shared": "What is shared",
    "drift": "Drift",
    "robots": "Robots",
    "method": "How it was found",
}
_MOST = 60  # parameters in the chart


def write(document: dict, path: Path) -> Path:
    """Write the page of a fleet's document as one HTML file. Raises SysidError: it cannot be."""
    made = {name: make(document) for name, make in _SECTIONS.items()}
    plain = {
        name: {"title": section.title, "html": section.html(), "charts": section.charts}
        for name, section in made.items()
    }
    name = f"Fleet of {len(document['robots'])}"
    text = page.page(name, plain, template="fleet", short=_SHORT)
    whole_files.write_atomically(path, lambda p: p.write_text(text, encoding="utf-8"))
    return path


def _verdict(document: dict) -> Section:
    by_robot: dict[str, list[dict]] = {}
    for entry in document["odd"]:
        by_robot.setdefault(entry["robot"], []).append(_cause(entry))
    values = {
        "robots": by_robot,
        "count": len(document["robots"]),
        "rate": percentage(document["false_alarm_rate"]),
        "failed": document["failed"],
        "notices": document["notices"],
    }
    return Section("Which robots are odd", "fleet_odd", values)


def _cause(entry: dict) -> dict:
    away = f"{plus_minus(entry['size'], entry['std'])}{unit_of(entry['unit'])}"
    share = entry["relative"]
    more = "" if share is None else f"{100 * share:+.0f}{SPACE}%".replace("-", "−")
    others = [
        f"{name.rpartition('.')[2]} {plus_minus(p['size'], p['std'])}{unit_of(p['unit'])}"
        for name, p in entry["parameters"].items()
        if name != entry["parameter"] and p["std"] and abs(p["size"]) > 2.0 * p["std"]
    ]
    return {
        "parameter": entry["parameter"],
        "away": away,
        "share": more,
        "others": others,
        "tied": entry["tied_with"],
    }


def _differs(document: dict) -> Section:
    rows = [
        [
            d["parameter"],
            plus_minus(d["value"], d["std"]),
            unit_of(d["unit"]) or "–",
            number(d["between"], 3),
            number(d["within"], 2),
            ", ".join(d["odd"]) or "–",
        ]
        for d in document["differs"]
    ]
    names = [d["parameter"] for d in document["differs"] if d["value"] is not None][:_MOST]
    drawn = [_strip(document, names)] if names else []
    values = {"rows": rows, "charts": drawn}
    return Section("What differs from robot to robot", "fleet_differs", values, drawn)


def _strip(document: dict, names: list[str]) -> dict:
    """Every robot's deviation from the others, parameter by parameter."""
    groups: dict[bool, list[tuple[float, str, str]]] = {False: [], True: []}
    for robot, entry in document["robots"].items():
        for name in names:
            found = entry["parameters"].get(name, {"z_score": None})
            if found["z_score"] is not None:
                groups[found["odd"]].append((found["z_score"], name, robot))
    data = [
        {
            "type": "scatter",
            "mode": "markers",
            "name": word,
            "x": charts.rounded([z for z, _, _ in points]),
            "y": [charts.plain(name) for _, name, _ in points],
            "text": [charts.plain(robot) for _, _, robot in points],
            "marker": {
                "color": colour,
                "size": 9 if strong else 6,
                "opacity": 1 if strong else 0.5,
            },
            "hovertemplate": "%{text}: %{x:.3g} deviations",
        }
        for strong, word, colour in (
            (False, "a robot", charts.BLUE),
            (True, "stands out", charts.VERMILLION),
        )
        if (points := groups[strong])
    ]
    layout = {
        "xaxis": charts.axis(
            "deviation from the other robots [standard deviations]", zeroline=True
        ),
        "yaxis": {
            "type": "category",
            "autorange": "reversed",
            "automargin": True,
            "showgrid": True,
        },
        "showlegend": True,
        "legend": charts.LEGEND,
    }
    label = "Every robot's deviation from the others in each parameter that differs"
    return charts.chart("strip", label, data, layout, height=120 + 22 * len(names))


def _shared(document: dict) -> Section:
    rows = [
        [
            s["parameter"],
            plus_minus(s["value"], s["std"]),
            unit_of(s["unit"]) or "–",
            number(s["within"], 2),
        ]
        for s in document["shared"]
    ]
    return Section("What all share", "fleet_shared", {"rows": rows})


def _drift(document: dict) -> Section:
    dates = {name: (r["date"], r["date_from"]) for name, r in document["robots"].items()}
    rows = [
        [
            d["parameter"],
            plus_minus(d["per_year"], d["std"]),
            f"{unit_of(d['unit'])} a year".strip(),
        ]
        for d in document["drift"]
    ]
    fields = sorted({field for _, field in dates.values() if field})
    days = sorted(day for day, _ in dates.values() if day)
    values = {
        "rows": rows,
        "known": len(days),
        "fields": fields[:3],
        "more": len(fields) > 3,
        "span": [days[0], days[-1]] if days else [],
    }
    return Section("How parameters drift over dates", "fleet_drift", values)


def _robots(document: dict) -> Section:
    joints = list(next(iter(document["robots"].values()))["rms_test"])
    rows = []
    for name, robot in document["robots"].items():
        pairs = [
            f"{level(robot['rms_test'][j])} / {level(robot['rms_test_of_mean'][j])}" for j in joints
        ]
        rows.append([name, robot["date"] or "–", *pairs])
    return Section(
        "Every robot", "fleet_robots", {"heads": ["robot", "date", *joints], "rows": rows}
    )


def _method(document: dict) -> Section:
    wide = sorted(document["stated_deviations_times"].items(), key=lambda item: -item[1])
    values = {
        "rate": percentage(document["false_alarm_rate"]),
        "threshold": f"{document['threshold']:.1e}".replace("-", "−"),
        "widened": [(name, number(times, 3)) for name, times in wide if times > 1.05][:10],
        "versions": list(document["versions"].items()),
    }
    return Section("How it was found", "fleet_method", values)


_SECTIONS = {
    "verdict": _verdict,
    "differs": _differs,
    "shared": _shared,
    "drift": _drift,
    "robots": _robots,
    "method": _method,
}
