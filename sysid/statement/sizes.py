"""What logs could have shown, as a table of plain text: the smallest detectable sizes."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..units import behind
from .tables import columns
from .words import wrapped

_MOST = {"": 1.0, "1": 1.0, "rad": math.pi}  # a share of all of it, half a turn


def fitting(document: dict, joints: Sequence[str], width: int) -> list[str]:
    """The sizes where all joints stand beside each other in the width; else where they stand: in
    several tables they drive the verdict off the screen."""
    own = _cells(document, joints)
    if len(_parts(own, joints, width)) < 2:
        return shown(document, joints, width)
    words = f"what these logs could have shown, the smallest size of {len(own)} effects on "
    words += f"{len(joints)} joints: a table of the report, and `detectable` in diagnosis.json"
    return wrapped(words, width, "  ")


def shown(document: dict, joints: Sequence[str], width: int) -> list[str]:
    """The smallest sizes that the logs would have named, effects down and joints across."""
    sizes, absorbed = _found(document)
    if not sizes and not absorbed:
        return []
    out = ["what these logs could have shown: the smallest size named nine times in ten"]
    own = _cells(document, joints)
    for some in _parts(own, joints, width):
        rows = [[effect, *(cells[k] for k in some)] for effect, cells in own.items()]
        out += columns(["", *(joints[k] for k in some)], [r for r in rows if any(r[1:])], 1)
    if whole := [f"{_label(key)} {cells['*']}" for key, cells in sizes.items() if "*" in cells]:
        out += wrapped(f"  of the whole robot: {'; '.join(whole)}", width, "    ")
    if any("-" in cells for cells in own.values()):
        words = "-: at no size that a robot can have, as other parameters take its place; "
        words += "`sysid effects NAME` says what shows it"
        out += wrapped(f"  {words}", width, "    ")
    if shaped := dict.fromkeys(d["effect"] for d in document["detectable"] if d["at"]):
        words = f"  {', '.join(shaped)}: at the values of their shape that show them best"
        out += wrapped(words, width, "    ")
    kinds: dict[str, set[tuple]] = {}
    for d in document["detectable"]:
        kinds.setdefault(d["effect"], set()).add(tuple((d.get("options") or {}).items()))
    alike = [(effect, *own) for effect, own in kinds.items() if len(own) == 1]
    said = [f"{effect} with {name}: {value}" for effect, own in alike for name, value in own]
    if said:
        out += wrapped(f"  {', '.join(said)}; with another option less may show", width, "    ")
    somewhere = {effect for effect, *_ in sizes}
    named = {f["effect"] for f in document["findings"] if f["joins_as_step"]}
    for other in (False, True):
        every = dict.fromkeys(e for e, _ in absorbed if (e in named) is other)
        if never := [e for e in every if e not in somewhere]:
            where = "another joint than named" if other else "any joint"
            out += wrapped(f"  at no size on {where}: {', '.join(never)}", width, "    ")
    return out


def _found(document: dict) -> tuple[dict, dict]:
    """{(effect, parameter, unit): {joint: size}}, and {(effect, joint): "-"} of the absorbed."""
    sizes: dict[tuple[str, str, str], dict[str, str]] = {}
    for d in document["detectable"]:
        cell = size(d["size"]) if possible(d) else "-"
        sizes.setdefault((d["effect"], d["parameter"], d["unit"]), {})[d["joint"]] = cell
    return sizes, {(a["effect"], a["joint"]): "-" for a in document["absorbed"]}


def _cells(document: dict, joints: Sequence[str]) -> dict[str, list[str]]:
    """The rows of the table; no cell: the effect is in the model already."""
    sizes, absorbed = _found(document)
    return {
        _label(key): [cells.get(j, absorbed.get((key[0], j), "")) for j in joints]
        for key, cells in sizes.items()
        if set(cells) != {"*"}
    }


def _label(key: tuple[str, str, str]) -> str:
    effect, parameter, unit = key
    return f"{effect} {parameter}{behind(unit, ' [{}]')}"


def _parts(rows: dict, joints: Sequence[str], width: int) -> list[list[int]]:
    """Places of joints, as many together as stand in the width beside the names of the rows."""
    first = 2 + max(map(len, rows), default=0)
    parts: list[list[int]] = [[]] if rows else []
    for k in range(len(joints) if rows else 0):
        if parts[-1] and first + sum(2 + max(len(joints[i]), 6) for i in [*parts[-1], k]) > width:
            parts.append([])
        parts[-1].append(k)
    return parts


def possible(d: dict) -> bool:
    """Whether a robot can have an effect of a detectable size."""
    return d["size"] <= _MOST.get(d["unit"], math.inf)


def size(value: float) -> str:
    """Two digits, without an exponent where that is short."""
    return f"{value:.2g}" if not 10 <= abs(value) < 1e5 else f"{float(f'{value:.2g}'):.0f}"
