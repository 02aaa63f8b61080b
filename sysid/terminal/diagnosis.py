"""What a diagnosis says, and what changed on a new log."""

from rich.console import Console
from rich.text import Text

from ..addition import typed
from ..statement import sizes, tables, text, where
from ..statement.changes import named
from ..unexplained import WEIGHED
from .next_steps import implausible, mended_first, next_line, next_step, out_of
from .tables import number, show_notices, table, terminal_width


def show_diagnosis(found, document: dict, experiment=None, before=()) -> None:
    """The verdict in words, then what it rests on.

    Args:
        before: notices that were told already.
    """
    of, width = text.told(found, document), terminal_width()
    _show_warnings(document)
    show_verdict(of, width)
    parts = [tables.errors(of, width), tables.suspects(document, width), tables.events(document, width), where.fails(document, width)]
    for lines in [*parts, sizes.fitting(document, found.fit.joints, width)]:
        if lines:
            print("\n" + "\n".join(lines))
    print()
    said = {*implausible(document), *_said(document)}
    show_notices({"notices": [n for n in document["notices"] if n not in said]}, before)
    print(f"run folder: {document['run']}")
    if experiment is not None:
        _after_diagnosis(found, document, experiment)


def _said(document: dict) -> list[str]:
    """Notices on what is not claimed that the verdict on a joint has told."""
    told = " ".join(v.get("says", "") for v in document["verdict"])
    return [f"{r['effect']} on {r['joint']} is not claimed: {r['why']}" for r in document["not_claimed"] if r["why"] in told]


def _show_warnings(document: dict) -> None:
    """First what makes all the rest doubtful."""
    if implausible(document):
        show_notices({"notices": implausible(document)})
        print()


def _after_diagnosis(found, document: dict, experiment) -> None:
    """What is typed next: the first addition, what mends numbers that cannot be meant, what may be it, how joints are weighed, a law to
    begin with, the motion to log, or the page with all of it."""
    commands = [c for v in document["verdict"] for c in v.get("commands", ())]
    steps = sorted((f for f in document["findings"] if f["command"] in commands and f["joins_as_step"]), key=lambda f: f["joins_as_step"])
    first, ordered = next(iter(steps), None), list(dict.fromkeys(f["command"] for f in steps))
    if ordered != [c for c in dict.fromkeys(commands) if c in ordered]:
        words = "each of these builds on those before it, and so do the errors above: add them in this order"
        print("\n".join([*text.wrapped(words, terminal_width(), "  "), *ordered]))
    may = [v["may_be"]["command"] for v in document["verdict"] if "may_be" in v]
    even = [v["joint"] for v in document["verdict"] if "weighting" in v]
    target, out = typed(experiment.path), out_of(experiment, document["run"])
    # what the evidence names comes first: it is told with the masses as they are, and may be what bends them
    if first is None and mended_first(document, experiment, found.fit):
        return
    if first is not None:
        next_line(first["command"], out=out)
    elif where.touched(document):  # it bends what is left of the others
        next_step("diagnose", target, first="leave out what is no motion of the robot, if it is none", out=out)
    elif may:
        next_line(may[0], out=out)
    elif even:
        next_step("diagnose", target, first=f"write {WEIGHED} for {text.listed(even, 'and')}", out=out)
    elif laws := [v["law"]["command"] for v in document["verdict"] if "law" in v]:
        next_line(laws[0], out=out)
    elif document.get("next_log"):
        next_line(document["next_log"])
    else:
        next_step("report", target, "--open", out=out)


def show_verdict(of, width: int) -> None:
    """A paragraph a joint, what it begins with in bold."""
    console = Console()
    for lead, lines in text.verdict(of, width):
        whole = "\n".join(lines)
        # a name with spaces may be cut by the end of a line
        start = len(lead) if whole.startswith(lead) else 0
        words = Text(whole)
        words.stylize("bold", 0, start)
        console.print(words, soft_wrap=True, highlight=False)


def show_changed(document: dict) -> None:
    """What is different on a log while a fitted model is held."""
    rows = [
        [joint, *(number(v) for v in (entry["rms"]["held"], entry["rms"]["after"], entry["left_as_logged"])), "not known" if entry["noise_floor"] is None else number(entry["noise_floor"])]
        for joint, entry in document["joints"].items()
    ]
    table("the held model on the new log, low-passed at 15 Hz; with the changes as logged, and the noise floor of that [N m or N]", ["joint", "RMS held", "RMS with the changes", "as logged", "noise floor"], rows)
    open_yet = [v for v in document["verdict"] if v["status"] == "unresolved"]
    above = any(v["times_noise"] for v in open_yet)
    if not document["findings"]:
        if above:
            print("no change is told that lasts all of the log")
        elif open_yet:
            print("nothing has changed, for all that is known of the noise")
        else:
            print("nothing has changed: all joints are at their noise floor")
    for v in (v for v in document["verdict"] if "says" in v):
        for line in text.wrapped(f"{v['joint']}: {v['says']}", terminal_width(), "  "):
            print(line)
    if above:
        print("where it comes within the log, `sysid.Online` tells when, in Python: it is fed the log row by row")
    for f in document["findings"]:
        print(f"{named(f)}: removes {text.percent(max(f['misfit_removed'], 0.0))} of the squared residual")
        for name, p in f["parameters"].items():
            print(f"  {text.valued(name, p)}" if p["std"] is not None else f"  {name}: this log does not tell it")
    show_notices(document)
    print(f"run folder: {document['run']}")
