"""What a diagnosis says, and what changed on a new log."""

from rich.console import Console
from rich.text import Text

from ..addition import typed
from ..statement import sizes, tables, text
from .next_steps import doubtful, implausible, next_step
from .tables import number, show_notices, table, terminal_width


def show_diagnosis(found, document: dict, experiment=None) -> None:
    """The verdict in words, then what it rests on."""
    of, width = text.told(found, document), terminal_width()
    _show_warnings(document)
    show_verdict(of, width)
    parts = [tables.errors(of, width), tables.suspects(document, width), tables.events(document, width), tables.fails(document, width)]
    for lines in [*parts, sizes.fitting(document, found.fit.joints, width)]:
        if lines:
            print("\n" + "\n".join(lines))
    print()
    show_notices({"notices": [n for n in document["notices"] if n not in implausible(document)]})
    print(f"run folder: {document['run']}")
    if experiment is not None:
        _after_diagnosis(document, experiment)


def _show_warnings(document: dict) -> None:
    """First what makes all the rest doubtful."""
    if implausible(document):
        show_notices({"notices": implausible(document)})
        print()


def _after_diagnosis(document: dict, experiment) -> None:
    """What is typed next: what checks logs that cannot be meant, the first addition, or the page with all of it."""
    commands = [c for v in document["verdict"] for c in v.get("commands", ())]
    first = min((f for f in document["findings"] if f["command"] in commands and f["joins_as_step"]), key=lambda f: f["joins_as_step"], default=None)
    if doubtful(document, experiment):
        next_step("check", typed(experiment.path))
    elif first is not None:
        print(f"next: {first['command']}")
    else:
        next_step("report", typed(experiment.path), "--open")


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
    rows = [[joint, number(entry["rms"]["held"]), number(entry["rms"]["after"])] for joint, entry in document["joints"].items()]
    table("the held model on the new log, low-passed at 15 Hz [N m or N]", ["joint", "RMS held", "RMS with the changes"], rows)
    if not document["findings"]:
        print("nothing has changed that one half of the log would tell of the other")
    for f in document["findings"]:
        print(f"{f['effect']} on {f['joint']}: removes {text.percent(max(f['misfit_removed'], 0.0))} of the squared residual")
        for name, p in f["parameters"].items():
            print(f"  {text.valued(name, p)}")
    show_notices(document)
    print(f"run folder: {document['run']}")
