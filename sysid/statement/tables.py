"""What a verdict rests on, as tables of plain text: errors, suspects, events.

A table is as wide as what stands in it: no name is ever cut.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..events import TOLD, WORDS, again, plural
from .text import Told
from .words import listed, percent, wrapped

_EVENTS, _FEW = 20, 4  # lines; of one kind in one log: more are one line


def errors(of: Told, width: int) -> list[str]:
    """Errors against the noise floors, and how these were found or why they were not."""
    named = bool(of.document["findings"])
    heads = [
        "joint",
        "",
        "train",
        "test",
        *(["test, all added"] if named else []),
        "noise floor",
        "+-",
    ]
    rows, how = [], {}
    for joint, entry in of.document["joints"].items():
        floor, se = entry["noise_floor"], entry["noise_floor_se"]
        added = [level(of.after[joint] if entry["rms"]["test"] is not None else None)]
        added = added if named else []
        rows.append(
            [
                joint,
                of.units[joint],
                level(entry["rms"]["train"]),
                level(entry["rms"]["test"]),
                *added,
                "not known" if floor is None else f"{floor:.4g}",
                "" if se is None else f"{se:.2g}",
            ]
        )
        how.setdefault(entry["floor_detail"], []).append(joint)
    of_rows = f"  over the rows that count, {of.document['band']}"
    out = ["RMS error against the noise floor", of_rows, *fitted(heads, rows, 2, width)]
    for detail, joints in how.items():
        out += wrapped(f"  noise floor of {listed(joints, 'and')}: {detail}", width, "    ")
    return out


def suspects(document: dict, width: int) -> list[str]:
    """What is named, step by step, each with what could stand in its place."""
    rows, step = [], 0
    for f in document["findings"]:
        step = f["joins_as_step"] or step
        joint = "robot" if f["joint"] == "*" else f["joint"]
        rows.append(
            [
                str(step),
                ("* " if f["joins_as_step"] else "  ") + f["effect"],
                joint,
                percent(f["probability"]),
                f"{f['rms_test_before']:.4g}",
                f"{f['rms_test_after']:.4g}",
            ]
        )
    if not rows:
        return []
    heads = ["step", "suspect", "joint", "probability", "test before", "after"]
    return [
        "suspects, step by step: * is kept, and the next step starts from the model with it",
        *fitted(heads, rows, 3, width),
    ]


def events(document: dict, width: int) -> list[str]:
    """What disturbed the logs: a line each, or one for many of a kind in a log."""
    kinds: dict[tuple[str, str], list[dict]] = {}
    for e in document["events"]:
        kinds.setdefault((e["kind"], e["log"]), []).append(e)
    out, shown = [], [one for some in kinds.values() if len(some) <= _FEW for one in some]
    for (kind, log), some in kinds.items():
        if len(some) > _FEW:
            out += wrapped(f"  {_many(kind, log, some)}", width, "    ")
    for e in shown[:_EVENTS]:
        span = (
            f"{e['start']:.2f} s"
            if e["stop"] - e["start"] < 0.01
            else f"{e['start']:.2f} to {e['stop']:.2f} s"
        )
        told = f" ({TOLD[e['kind']]})" if e["kind"] in TOLD else ""
        out += wrapped(
            f"  {WORDS.get(e['kind'], e['kind'])}, {e['log']}, {span}: "
            f"{', '.join(e['joints'])}{told}",
            width,
            "    ",
        )
    more = len(shown) - _EVENTS
    if more > 0:
        out.append(f"  and {more} more: see diagnosis.json")
    struck = [j for e in document["events"] if e["kind"] == "knock" for j in e["joints"]]
    said = again(struck, len(document["joints"]))
    out += wrapped(f"  {said}", width, "    ") if said else []
    return ["events in the logs, left out", *out] if out else []


def _many(kind: str, log: str, some: list[dict]) -> str:
    joints = [joint for e in some for joint in e["joints"]]
    on = ", ".join(f"{joint} {joints.count(joint)}" for joint in dict.fromkeys(joints))
    span = f"{min(e['start'] for e in some):.2f} to {max(e['stop'] for e in some):.2f} s"
    told = f" ({TOLD[kind]})" if kind in TOLD else ""
    words = f"{len(some)} {plural(kind, len(some))}, {log}, {span}: {on}{told}"
    return f"{words}; each in diagnosis.json"


def level(value: float | None) -> str:
    """An error to four digits, a dash where there is none."""
    return "-" if value is None else f"{value:.4g}"


def columns(heads: Sequence[str], rows: Sequence[Sequence[str]], left: int) -> list[str]:
    """A table as wide as its cells, its first `left` columns ranged left, the others right."""
    wide = [max(len(row[k]) for row in [heads, *rows]) for k in range(len(heads))]

    def cell(k: int, word: str) -> str:
        return word.ljust(wide[k]) if k < left else word.rjust(wide[k])

    lines = ("  ".join(cell(k, word) for k, word in enumerate(row)) for row in [heads, *rows])
    return [f"  {line}".rstrip() for line in lines]


def fitted(heads: Sequence[str], rows: Sequence[Sequence[str]], left: int, width: int) -> list[str]:
    """The same in a width: of a table that is wider, as many columns at a time as there is room
    for, each time beside its first `left`. No cell is cut: one alone may be wider."""
    wide = [max(len(row[k]) for row in [heads, *rows]) + 2 for k in range(len(heads))]
    parts: list[list[int]] = [[]]
    for k in range(left, len(heads)):
        if parts[-1] and sum(wide[:left]) + sum(wide[i] for i in [*parts[-1], k]) > width:
            parts.append([])
        parts[-1].append(k)
    pick = lambda row, part: [row[k] for k in [*range(left), *part]]  # noqa: E731
    return [
        line
        for part in parts
        for line in columns(pick(heads, part), [pick(row, part) for row in rows], left)
    ]
