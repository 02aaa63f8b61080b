"""Everything that the benchmark's page says, counted from its records."""

from __future__ import annotations

import statistics

from . import claims, sizes
from .fourth_laws import FOURTH
from .hidden import ABSORBED, EFFECTS, OUTSIDE
from .new_laws import NEW
from .old_laws import OLD
from .robots import JOINTS
from .scoring import CATEGORIES, NAMED, VISIBLE, WITHIN, score, share
from .third_laws import THIRD

#: what is asked under each of the conditions; None: not asked
_ASKED = {
    "clean": {
        "cases": 300,
        "controls": 100,
        "named": 0.95,
        "alone": 0.87,
        "false": 0.03,
        "accused": 0.01,
        "unknown": 0.02,
        "at peace": 0.97,
    },
    "nuisances": {
        "cases": 200,
        "controls": 50,
        "named": 0.90,
        "alone": None,
        "false": 0.05,
        "accused": None,
        "unknown": None,
        "at peace": 0.95,
    },
    "sines": {
        "cases": 60,
        "controls": None,
        "named": None,
        "alone": None,
        "false": None,
        "accused": None,
        "unknown": None,
        "at peace": None,
    },
}
_LAWS = (
    ("outside, old laws", "old laws (known while the method was tuned)", OLD, 0.80),
    ("outside, new laws", "new laws (no change of the method was made for them)", NEW, 0.85),
    (
        "outside, third laws",
        "third laws (written later, by somebody who had not seen the method)",
        THIRD,
        0.85,
    ),
    (
        "outside, fourth laws",
        "fourth laws (written last, by somebody who had not seen the method)",
        FOURTH,
        0.85,
    ),
)
_LOWERED = (-1e9, 0.02, 0.05, 0.10, 0.20, 0.35, 0.50, 1.01)


def summary(records: list[dict], under: str = "clean") -> dict:
    """Everything that the page says, from the records made under some conditions."""
    rows = [row for record in records for row in score(record)]
    known = [r for r in rows if r["kind"] in ("one", "two") and r["effect"] not in ABSORBED]
    seen, unseen = [r for r in known if r["visible"]], [r for r in known if not r["visible"]]
    absorbed = [r for r in rows if r["effect"] in ABSORBED]
    outside = [r for r in rows if r["kind"] == "outside"]
    out_seen = [r for r in outside if r["visible"]]
    controls = [r for r in records if r["kind"] == "control"]
    failed = [r for r in records if r["error"] is not None]
    count = lambda of, key, *values: sum(r[key] in values for r in of)  # noqa: E731
    accused = [
        r
        for r in controls
        if r["error"] is not None
        or any(v["status"] in ("missing", "explained") for v in r["verdict"])
    ]
    unknown = [
        r
        for r in controls
        if r["error"] is None and any(v["status"] == "unknown" for v in r["verdict"])
    ]
    named = [r for r in seen if r["category"] in NAMED]
    whole = [r for r in rows if r["category"] != "error"]
    unresolved = [
        r
        for r in controls
        if r["error"] is None and any(v["status"] == "unresolved" for v in r["verdict"])
    ]
    at_peace = [r for r in controls if r not in accused and r not in unknown]
    said = claims.counts(records)
    sets = [r for r in seen if r.get("said")]
    held = [r for r in sets if any(r["effect"] in words for words in r["said"])]
    ask = _ASKED[under]
    bars = [
        _bar("cases", f"cases, controls included ({len(records) - len(controls)} with something hidden)", len(records), ask["cases"]),
        _bar("controls", "controls", len(controls), ask["controls"]),
        _bar("named", "visible effects named, alone or at the head of a family", share(len(named), len(seen)), ask["named"]),
        _bar("alone", "visible effects named alone", share(count(seen, "category", "alone"), len(seen)), ask["alone"]),
        _bar("false claims", "claims of the first verdict that are not there, of all claims", share(*said["false claims"]), ask["false"], most=True),
        _bar("sets", "visible effects in the set (or family) of a verdict that names something on their joint", share(len(held), len(sets)), 0.87),
        _bar("controls accused", "controls with any accusation", share(len(accused), len(controls)), ask["accused"], most=True),
        _bar("controls unknown", "controls called unknown", share(len(unknown), len(controls)), ask["unknown"], most=True),
        _bar("controls at peace", "controls neither accused nor unknown", share(len(at_peace), len(controls)), ask["at peace"]),
        _bar("floors", "joints whose noise floor is within 25 % of the true noise, or null", share(*said["floors"]), 0.90),
        _bar("after discover", "named cases whose held-out RMS after discover is within 5 % of the true model's", share(sum(r["within"] for r in named), len(named)), 0.90),
        _bar("sizes", "parameters of effects named rightly within two stated deviations of the truth", share(*sizes.covered(records)), 0.92),
        *(
            _bar(name, f"visible effects outside the catalogue, {says}, called unknown, or explained by 80 %",
                 share(count(own, "category", "unknown", "explained"), len(own)), bound)
            for name, says, laws, bound in _LAWS for own in [[r for r in out_seen if r["effect"] in laws]]
        ),
    ]  # fmt: skip
    bars = [bar for bar in bars if bar["bound"] is not None]
    table = lambda of: {c: count(of, "category", c) for c in CATEGORIES}  # noqa: E731
    seconds = {
        robot: [r["seconds"]["all"] for r in records if r["robot"] == robot] for robot in JOINTS
    }
    return {
        "bars": bars,
        "cases": {kind: sum(r["kind"] == kind for r in records) for kind in ("one", "two", "outside", "control")},
        "visible": {"all": table(seen), "one": table([r for r in seen if r["kind"] == "one"]), "two": table([r for r in seen if r["kind"] == "two"])},
        "not_visible": table(unseen),
        "robots": {robot: table([r for r in seen if r["robot"] == robot]) for robot in JOINTS},
        "effects": {e: {"hidden": count(known, "effect", e), **table([r for r in seen if r["effect"] == e])} for e in EFFECTS},
        "absorbed": {e: table([r for r in absorbed if r["effect"] == e]) for e in ABSORBED},
        "outside": {
            kind: {"hidden": count(outside, "effect", kind), "visible": len(own), **{c: count(own, "category", c) for c in ("unknown", "explained", "wrong", "unresolved", "missed", "error")},
                   "admits": sum(bool(r.get("admits")) and r["category"] == "wrong" for r in own)}
            for kind in OUTSIDE for own in [[r for r in out_seen if r["effect"] == kind]]
        },
        "claims": {
            "false": share(*said["false claims"]), "false_as_said": share(*said["false claims, as said"]), "false_families_too": share(*said["false claims, families too"]), "list": said["false"],
            "members": statistics.fmean(len(words) for r in sets for words in r["said"][:1]) if sets else None,
        },
        "floors": {"good": share(*said["floors"]), "null": share(*said["floors null"]), "ratio": said["ratios"]},
        "controls": {"accused": share(len(accused), len(controls)), "unknown": share(len(unknown), len(controls)),
            "unresolved": share(len(unresolved), len(controls)), "at_peace": share(len(at_peace), len(controls)), "unknown_joints": share(
            *(sum(v["status"] in of for r in controls for v in r.get("verdict", [])) for of in (("unknown",), ("unknown", "missing", "complete", "explained", "unresolved")))), "by_robot": {
            robot: {"controls": count(controls, "robot", robot), "accused": count(accused, "robot", robot), "unknown": count(unknown, "robot", robot)} for robot in JOINTS}},
        "by_lowered": [
            {"from": low, "to": high, "named": share(sum(r["category"] in NAMED for r in own), len(own)), "alone": share(count(own, "category", "alone"), len(own)),
             "wrong": share(count(own, "category", "wrong", "named among also"), len(own))}
            for low, high in zip(_LOWERED, _LOWERED[1:]) for own in [[r for r in known if r["lowered"] is not None and low <= r["lowered"] < high]]
        ],
        "named_with_extras": share(sum(bool(r["extra"]) for r in named), len(named)),
        "innocent_joints": share(len({r["key"] for r in whole if r["innocent"]}), len({r["key"] for r in whole})),
        "true_beaten": sorted({r["key"] for r in known if r["category"] != "error" and r["after"] < (1.0 - WITHIN) * r["true"]}),
        "true_fails": [
            {k: r[k] for k in ("key", "effect", "joint", "size", "hurts", "lowered", "category", "named")} for r in unseen if r.get("hurts", 0.0) >= VISIBLE
        ],
        "confusion": confusion(rows, controls), "errors": [{"key": r["key"], **r["error"]} for r in failed],
        "seconds": {robot: {"cases": len(own), "median": statistics.median(own), "most": max(own)} for robot, own in seconds.items() if own},
        "rows": rows,
    }  # fmt: skip


def _bar(name: str, says: str, reached, bound: float, most: bool = False) -> dict:
    value = reached if isinstance(reached, int) else reached["share"]
    met = value is not None and bound is not None and (value <= bound if most else value >= bound)
    return {
        "name": name,
        "says": says,
        "reached": reached,
        "bound": bound,
        "most": most,
        "met": met,
    }


def confusion(rows: list[dict], controls: list[dict]) -> dict:
    """Visible hidden effects by what was named on their joint; the controls' joints by what was named on them."""
    hidden = [*EFFECTS, *OUTSIDE, "nothing"]
    table: dict[str, dict[str, int]] = {name: {} for name in hidden}
    for row in rows:
        if row["visible"] and row["effect"] in table:
            table[row["effect"]][row["named"]] = table[row["effect"]].get(row["named"], 0) + 1
    for record in controls:
        for verdict in record.get("verdict", []):
            named = verdict.get("effect") or verdict["status"]
            table["nothing"][named] = table["nothing"].get(named, 0) + 1
    words = [
        *EFFECTS,
        *sorted(
            {n for own in table.values() for n in own}
            - {*EFFECTS, "unknown", "unresolved", "complete", "error"}
        ),
        "unknown",
        "unresolved",
        "complete",
        "error",
    ]
    return {
        "hidden": hidden,
        "named": words,
        "counts": [[table[h].get(n, 0) for n in words] for h in hidden],
    }
