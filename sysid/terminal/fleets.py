"""A fleet's odd robots, and many new logs against one model."""

from rich.console import Console
from rich.markup import escape

from ..statement.changes import named
from .tables import number, show_notices, table


def show_fleet(document: dict) -> None:
    """Which robots are odd and in what; what differs, what is shared, what drifts."""
    rows = [[d["parameter"], ", ".join(d["odd"]), number(d["value"]), d["unit"], number(d["between"]), number(d["within"])] for d in document["differs"]]
    if rows:
        table("what differs from robot to robot", ["parameter", "odd", "mean", "unit", "between", "within"], rows)
    print(f"no difference can be told in {len(document['shared'])} of {len(document['shared']) + len(rows)} parameters")
    for d in document["drift"]:
        print(f"{d['parameter']} drifts by {d['per_year']:+.3g} +- {d['std']:.2g} {d['unit']} a year")
    for entry in document["failed"]:
        Console().print(f"[red]left out[/red] {escape(entry['experiment'])}: {escape(entry['says'])}", soft_wrap=True, highlight=False)
    show_notices(document)
    count = len(document["robots"])
    if not document["odd"]:
        print(f"none of {count} robots is odd")
    for entry in document["odd"]:
        std = "" if entry["std"] is None else f" +- {entry['std']:.2g}"
        share = "" if entry["relative"] is None else f" ({100 * entry['relative']:+.0f} %)"
        tied = f"; these logs cannot tell it from a change of {' or '.join(entry['tied_with'])}" if entry["tied_with"] else ""
        print(f"{entry['robot']} is odd in {entry['parameter']}: {entry['size']:+.4g}{std} {entry['unit']} from the others{share}{tied}")
    print(f"probability of any false alarm: {100 * document['false_alarm_rate']:g} %")


def show_against(document: dict) -> None:
    """What is different on each of many logs while a fitted model is held."""
    rows = []
    for log, entry in document["logs"].items():
        changes = [named(f) + (f", {m['value']:.3g} kg" if (m := f["parameters"].get("payload.*.m")) and m["std"] is not None else "") for f in entry["changes"]]
        ratio = max((entry["rms_held"][j] / after if after else 1.0) for j, after in entry["rms_after"].items())
        rows.append([log, ", ".join(changes) or "nothing changed", f"{ratio:.3g}"])
    table(f"against {document['against']}: what changed, and how many times smaller the error of a joint is with it", ["log", "changed", "times"], rows)
    for entry in document["failed"]:
        Console().print(f"[red]left out[/red] {escape(entry['log'])}: {escape(entry['says'])}", soft_wrap=True, highlight=False)
