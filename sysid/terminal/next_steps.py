"""The last line of a command: what is typed next."""

import json
import shlex
from contextlib import suppress
from pathlib import Path

from ..statement import text
from .tables import terminal_width


def next_step(command: str, *words, first: str = "") -> None:
    """The last line of a command: what is typed next, and what comes before it."""
    if first:
        print("\n".join(text.wrapped(f"{first}; then", terminal_width(), "  ")))
    print(f"next: {shlex.join(['sysid', command, *map(str, words)])}")


def implausible(document: dict) -> list[str]:
    """The notices that make all the rest doubtful."""
    return [notice for notice in document["notices"] if notice.startswith("implausible")]


def doubtful(document: dict, experiment) -> bool:
    """Whether the logs are to be checked first: what came of them cannot be meant, and no check since the experiment file
    was written found them in order."""
    said = Path(document["run"]) / "check.json"
    with suppress(OSError, ValueError, KeyError):
        if said.stat().st_mtime >= experiment.path.stat().st_mtime and json.loads(said.read_text())["ok"]:
            return False
    return bool(implausible(document))
