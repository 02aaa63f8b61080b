"""What a verdict rests on, as tables of plain text: errors and floors, suspects, events, what the logs could have shown.

A table is as wide as what stands in it: no name is ever cut.
"""

from __future__ import annotations

from collections.abc import Sequence

from .diagnosis_text import Told, listed, percent, wrapped
from .events import WORDS

_EVENTS = 20  # lines; the rest is counted


def errors(of: Told, width: int) -> list[str]:
    """Errors of each joint against its noise floor, and how the floors were found or why they were not."""
    named = bool(of.document["findings"])
    heads = ["joint", "", "train", "test", *(["test, all added"] if named else []), "noise floor", "+-"]
    rows, how = [], {}
    for joint, entry in of.document["joints"].items():
        floor, se = entry["noise_floor"], entry["noise_floor_se"]
        added = [f"{of.after[joint]:.4g}"] if named else []
        rows.append([
            joint, of.units[joint], f"{entry['rms']['train']:.4g}", f"{entry['rms']['test']:.4g}", *added,
            "not known" if floor is None else f"{floor:.4g}", "" if se is None else f"{se:.2g}",
        ])  # fmt: skip
        how.setdefault(entry["floor_detail"], []).append(joint)
    out = ["RMS error against the noise floor", *columns(heads, rows, "<<")]
    for detail, joints in how.items():
        out += wrapped(f"  noise floor of {listed(joints, 'and')}: {detail}", width, "    ")
    return out


def suspects(document: dict) -> list[str]:
    """What is named, step by step, each with what could stand in its place."""
    rows, step = [], 0
    for f in document["findings"]:
        step = f["joins_as_step"] or step
        joint = "robot" if f["joint"] == "*" else f["joint"]
        rows.append([
            str(step), ("* " if f["joins_as_step"] else "  ") + f["effect"], joint, percent(f["probability"]),
            f"{f['rms_test_before']:.4g}", f"{f['rms_test_after']:.4g}",
        ])  # fmt: skip
    if not rows:
        return []
    heads = ["step", "suspect", "joint", "probability", "test before", "after"]
    return [
        "suspects, step by step: * joins the model, and the next step is asked with it in",
        *columns(heads, rows, "<<<"),
    ]  # fmt: skip


def events(document: dict, width: int) -> list[str]:
    """What disturbed the logs, a line each."""
    out = []
    for e in document["events"][:_EVENTS]:
        span = f"{e['start']:.2f} s" if e["stop"] - e["start"] < 0.01 else f"{e['start']:.2f} to {e['stop']:.2f} s"
        told = " (not left out)" if e["kind"] == "saturation" else ""
        out += wrapped(f"  {WORDS.get(e['kind'], e['kind'])}, {e['log']}, {span}: {', '.join(e['joints'])}{told}", width, "    ")
    more = len(document["events"]) - _EVENTS
    if more > 0:
        out.append(f"  and {more} more: see diagnosis.json")
    return ["events in the logs, left out", *out] if out else []


def fails(document: dict, width: int) -> list[str]:
    """Where the joints that are not done with hold most of their error."""
    status = {v["joint"]: v["status"] for v in document["verdict"]}
    out = []
    for entry in document["fails_where"]:
        if entry["words"] and status[entry["joint"]] not in ("complete", "explained"):
            out += wrapped(f"where {entry['joint']} fails: {'; '.join(entry['words'])}", width, "  ")
    return out


def shown(document: dict, joints: Sequence[str], width: int) -> list[str]:
    """The smallest sizes that the logs would have named, effects down and joints across, in as many parts as the width asks."""
    sizes: dict[tuple[str, str, str], dict[str, str]] = {}
    for d in document["detectable"]:
        sizes.setdefault((d["effect"], d["parameter"], d["unit"]), {})[d["joint"]] = size(d["size"])
    absorbed = {(a["effect"], a["joint"]) for a in document["absorbed"]}
    out = ["what these logs could have shown: the smallest size named nine times in ten"] if sizes or absorbed else []
    own = {key: cells for key, cells in sizes.items() if set(cells) != {"*"}}
    label = lambda key: f"{key[0]} {key[1]}" + ("" if key[2] in ("", "1") else f" [{key[2]}]")  # noqa: E731
    first = max((len(label(key)) for key in own), default=0)
    part: list[str] = []
    parts = [part]
    for joint in joints:
        wide = first + sum(2 + max(len(j), 8) for j in [*part, joint])
        if part and wide > width:
            part = []
            parts.append(part)
        part.append(joint)
    for some in parts if own else []:
        cell = lambda key, j: own[key].get(j, "-" if (key[0], j) in absorbed else "")  # noqa: E731 - none: in the model
        rows = [[label(key), *(cell(key, j) for j in some)] for key in own if any(cell(key, j) for j in some)]
        out += columns(["", *some], rows, "<")
    if whole := [f"{label(key)} {cells['*']}" for key, cells in sizes.items() if "*" in cells]:
        out += wrapped(f"  of the whole robot: {'; '.join(whole)}", width, "    ")
    never = list(dict.fromkeys(effect for effect, _ in absorbed if effect not in {key[0] for key in sizes}))
    if own and any((key[0], joint) in absorbed for key in own for joint in joints):
        words = "-: at no size, as other parameters take its place; `sysid effects NAME` says what shows it"
        out += wrapped(f"  {words}", width, "    ")
    if never:
        out += wrapped(f"  at no size on any joint: {', '.join(never)}", width, "    ")
    return out


def size(value: float) -> str:
    """Two digits, without an exponent where that is short."""
    return f"{value:.2g}" if not 10 <= abs(value) < 1e5 else f"{float(f'{value:.2g}'):.0f}"


def columns(heads: Sequence[str], rows: Sequence[Sequence[str]], left_: str) -> list[str]:
    """A table of two spaces between columns, as wide as its cells; as many columns as `left_` is long stand to the left."""
    wide = [max(len(row[k]) for row in [heads, *rows]) for k in range(len(heads))]
    cell = lambda k, word: word.ljust(wide[k]) if k < len(left_) else word.rjust(wide[k])  # noqa: E731
    return ["  " + "  ".join(cell(k, word) for k, word in enumerate(row)).rstrip() for row in [heads, *rows]]
