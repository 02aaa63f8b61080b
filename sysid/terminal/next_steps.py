"""The last line of a command: what is typed next."""

import json
import shlex
from contextlib import suppress
from pathlib import Path

from ..addition import typed
from ..plausible import ASK, BEGINS, WRONG
from ..statement import text
from .tables import terminal_width


def next_step(command: str, *words, first: str = "", out=()) -> None:
    """The last line of a command: what is typed next, and what comes before it.

    Args:
        out: of `out_of`.
    """
    next_line(shlex.join(["sysid", command, *map(str, words)]), first=first, out=out)


def next_line(typed_whole: str, *, first: str = "", out=()) -> None:
    """The same of a whole command."""
    if first:
        print("\n".join(text.wrapped(f"{first}; then", terminal_width(), "  ")))
    print(f"next: {' '.join([typed_whole, *map(shlex.quote, out)])}")


def out_of(experiment, run) -> list[str]:
    """`--out` with a run folder that is not the one that commands take by themselves."""
    return [] if Path(run) == Path("runs") / experiment.name else ["--out", str(run)]


def implausible(document: dict) -> list[str]:
    """The notices that make all the rest doubtful."""
    return [notice for notice in document["notices"] if notice.startswith(BEGINS)]


def mended_first(document: dict, experiment, fit, *, diagnosed: bool = True) -> bool:
    """Tell what is done before anything that rests on numbers that cannot be meant: what brings masses back, where that is
    known; else a check of the logs, once. False where there is nothing of the kind.

    Args:
        fit: whose masses and filter are looked at.
        diagnosed: whether all effects were asked; else a diagnosis names more of them than those that bodies can hide.
    """
    out, target, masses = out_of(experiment, document["run"]), typed(experiment.path), fit.masses
    narrow = fit.filters.get("too_narrow") if _open(document) else None
    if not (narrow or implausible(document)):
        return False
    if any(WRONG in notice for notice in implausible(document)):
        next_step("check", target, first="correct the columns, or what the experiment file says of them", out=out)
        return True
    unchecked = not _checked(document, experiment)
    if unchecked and any(ASK in notice for notice in implausible(document)):  # wrong columns make masses, and effects that mend them
        next_step("check", target, first="how joints are explained cannot be meant: see what the logs say", out=out)
    elif narrow:  # noise of the angles bends masses too
        next_step("fit", target, first=f"angles are noisy for this filter: write `{narrow['key']}: auto` under `preprocess:` in {experiment.path}", out=out)
    elif masses.get("prior_weight") is not None:
        adds = f" and type {masses['command']}" if masses.get("command") else ""
        next_step("fit", target, first=f"the masses cannot be meant: write `weight: auto` under `prior:` in {experiment.path}{adds}", out=out)
    elif masses.get("command"):
        if not diagnosed:
            return False
        next_line(masses["command"], out=out)
    elif masses.get("stronger"):
        next_step("fit", target, first=f"the masses are far from the URDF's: where that is right, write `weight: {masses['stronger']:g}` under `prior:` in {experiment.path}", out=out)
    elif unchecked:
        next_step("check", target, first="the masses cannot be meant: see what the logs say", out=out)
    else:
        return False
    return True


def _open(document: dict) -> bool:
    """Whether something is left to explain, of a diagnosis; of a fit nobody knows."""
    return any(v["status"] != "complete" for v in document.get("verdict", ({"status": ""},)))


def _checked(document: dict, experiment) -> bool:
    """Whether the logs were checked since the experiment file was written, whatever came of it: who goes on has read it."""
    with suppress(OSError, ValueError, KeyError):
        said = Path(document["run"]) / "check.json"
        return said.stat().st_mtime >= experiment.path.stat().st_mtime and "ok" in json.loads(said.read_text())
    return False
