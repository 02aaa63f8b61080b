"""What additions changed: before and after, step by step."""

import math
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from ..addition import typed
from ..statement import text
from .diagnosis import show_verdict
from .next_steps import next_line, next_step, out_of
from .tables import number, show_notices, table, terminal_width

_NOTHING = 1e-6  # of an error: rounding
_OTHER = 0.01  # of an error: by so much a change is of other rows than the errors beside it


def show_added(document: dict, experiment, run, before=()) -> None:
    """The held-out error before and after an effect.

    Args:
        before: notices that were told already.
    """
    first, after = document["rms_test_before"], document["rms_test_after"]
    rows = [
        [d["joint"], number(first[d["joint"]]), number(after[d["joint"]]), f"{d['delta_rms']:+.{_decimals(first[d['joint']])}f}", "-" if d["se"] is None else f"{d['se']:.2g}"]
        for d in document["differences"]
    ]  # fmt: skip
    table(f"held-out RMS without and with {document['added']}", ["joint", "before", "after", "change", "standard error"], rows)
    changed = [(d["joint"], d["delta_rms"], first[d["joint"]], after[d["joint"]]) for d in document["differences"]]
    if other := [j for j, *known in changed if None not in known and abs(known[0] - (known[2] - known[1])) > _OTHER * known[1]]:
        words = f"the change on {text.listed(other, 'and')} is over rows that both fits count, and so not after less before"
        print("\n".join(text.wrapped(words, terminal_width(), "  ")))
    for parameter in document["parameters"]:
        if parameter["std"] is not None:
            print(text.valued(parameter["name"], parameter))
    untold = [parameter for parameter in document["parameters"] if parameter["std"] is None]
    if held := [parameter["name"] for parameter in untold if not parameter["value"] or parameter.get("held")]:
        print("\n".join(text.wrapped(f"held at zero or at the prior: {', '.join(held)}", terminal_width(), "  ")))
    if loose := [f"{one['name']} = {number(one['value'])}" for one in untold if one["name"] not in held]:
        print("\n".join(text.wrapped(f"told by these logs only together with other parameters: {', '.join(loose)}", terminal_width(), "  ")))
    if document["says"]:
        Console().print(escape(document["says"]), soft_wrap=True, highlight=False)
    changes = [(d["delta_rms"], first[d["joint"]]) for d in document["differences"]]
    nothing = not document["refused"] and all(abs(change or 0.0) <= _NOTHING * (was or 0.0) for change, was in changes)
    if not document["refused"]:
        print(f"written into {document['experiment']}")
        if nothing:
            words = f"nothing changes with it, as these logs show none of it: it may be taken out of {document['experiment']} again"
            print("\n".join(text.wrapped(words, terminal_width(), "  ")))
    if document["untold"] and not nothing:
        print("\n".join(text.wrapped(document["untold"], terminal_width(), "  ")))
    show_notices(document, before)
    next_step("diagnose", typed(Path(document["experiment"])), out=out_of(experiment, run))


def _decimals(level: float | None) -> int:
    """How many decimals four digits of an error have."""
    return 4 if not level else max(0, 3 - math.floor(math.log10(level)))


def show_step(step: dict) -> None:
    """One step of a discovery, as it is made."""
    what = "start" if step["added"] is None else f"+ {step['added']} on {step['joint']}"
    rms = ", ".join(f"{joint} {number(value)}" for joint, value in step["rms_test"].items())
    Console().print(f"{escape(what)}: held-out RMS {escape(rms)}", soft_wrap=True, highlight=False)


def show_discovery(said: dict, found, document: dict, experiment=None) -> None:
    """Where a discovery ended."""
    for entry in said["refused"]:
        print(f"not claimed: {entry['effect']} on {entry['joint']}: {entry['why']}")
    show_verdict(text.told(found, document), terminal_width())
    print(f"steps and experiment files: {said['run']}/steps")
    if experiment is None:
        return
    out = out_of(experiment, said["run"])
    if not said["commands"]:
        next_step("report", typed(experiment.path), "--open", out=out)
        return
    print(f"{experiment.path} is as it was; these commands, in order, write what was found into it:")
    for command in said["commands"]:
        print(f"  {command}")
    next_line(said["commands"][0], out=out)


_LONGEST_BAR = 20  # twice the error of the start, or more


def show_history(steps: list[dict], experiment, run) -> None:
    """The steps, one a line, and the error of each joint as a falling row of bars."""
    joints, first = list(steps[0]["rms_test"]), steps[0]["rms_test"]

    def cell(rms: dict, joint: str) -> str:
        now, before = rms.get(joint), first.get(joint)
        bar = "#" * min(max(1, round(10 * now / before)), _LONGEST_BAR) if now and before else ""
        return f"{number(now)} {bar.ljust(10)}" if joint in rms else ""

    rows = [
        [f"{number} start" if step["added"] is None else f"{number} + {step['added']} on {step['joint']}", *(cell(step["rms_test"], j) for j in joints)]
        for number, step in enumerate(steps)
    ]  # fmt: skip
    table("held-out RMS [N m, or N on a prismatic joint]; ten # are the error of the start", ["step", *joints], rows)
    out, found = out_of(experiment, run), [step["command"] for step in steps if step.get("command")]
    if found:
        print(f"steps that `sysid discover` made are not in {experiment.path}; these commands, in order, write them:")
        for command in found:
            print(f"  {command}")
        next_line(found[0], out=out)
    else:
        next_step("diagnose", typed(experiment.path), out=out)
