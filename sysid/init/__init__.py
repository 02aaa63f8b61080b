"""A robot and its logs -> an experiment folder, with what was guessed and why.

given.py    which of what was typed is the robot, which are logs
words.py    what names of columns say
columns.py  columns and joints -> which column is which joint's
logged.py   the logs, opened and read
robots.py   URDF, xacro or MJCF -> URDF
joints.py   which joints are identified, which are locked where
units.py    units and rate by the numbers
split.py    what trains, what is held out
physics.py  units by the robot's equations
draft.py    the experiment, guess by guess
text.py     its YAML, with the reasons
"""

from __future__ import annotations

import os
import shutil
from dataclasses import replace
from pathlib import Path

from ..errors import SysidError
from ..unfinished import beside
from . import text
from .draft import Wishes, draft
from .given import sorted_out
from .guess import Draft


def init(
    reference: str, logs: list[str], out: Path, wishes: Wishes | None = None
) -> tuple[Draft, Path]:
    """Write an experiment folder for a robot and its logs; returns what was guessed and the file.

    Args:
        reference: URDF, xacro or MJCF. logs: files, folders, patterns. out: the folder, new or
        without config.yaml.

    Raises:
        SysidError: something cannot be guessed or read, or a file would be overwritten. Nothing is
        written then.
    """
    if (out / "config.yaml").exists():
        raise SysidError(
            "there is an experiment already",
            where=str(out / "config.yaml"),
            do="give another folder with --out, or remove it",
        )
    # beside the folder, so that paths from inside are the same
    work = beside(out.absolute())
    try:
        work.mkdir(parents=True)
        found = draft(reference, logs, work, wishes or Wishes())
        command = (
            f"sysid init {Path(reference).name} "
            + " ".join(Path(log).name or log for log in logs[:4])
            + (" ..." if len(logs) > 4 else "")
        )
        found = _from_inside(found, out)
        (work / "config.yaml").write_text(text.yaml(found, command), encoding="utf-8")
        _moved(work, out)
    except OSError as error:
        raise SysidError(
            f"cannot be written ({error.strerror})",
            where=str(out),
            do="free the disk or give another --out",
        ) from None
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return found, out / "config.yaml"


def _from_inside(found: Draft, out: Path) -> Draft:
    """The draft with paths from its own folder, which was looked at from beside."""
    own = f"../{out.resolve().name}/"

    def inside(value):
        if isinstance(value, list):
            return [inside(one) for one in value]
        if isinstance(value, dict):
            return {key: inside(one) for key, one in value.items()}
        return value.removeprefix(own) if isinstance(value, str) else value

    parts = [found.guesses[key] for key in ("data.train", "data.test")]
    moved = [replace(guess, value=inside(guess.value)) for guess in parts]
    return replace(found, urdf=inside(found.urdf)).having(*moved)


def _moved(work: Path, out: Path) -> None:
    """Bring what was written into its folder, config.yaml last; what is there stays."""
    out.mkdir(exist_ok=True)
    for name in ("robot.urdf", "config.yaml"):
        source, target = work / name, out / name
        if not source.exists():
            continue
        if target.exists() and target.read_bytes() != source.read_bytes():
            raise SysidError(
                "the file is there already", where=str(target), do="give another folder with --out"
            )
        os.replace(source, target)


def document(found: Draft, file: Path) -> dict:
    """The document of `sysid init --json`."""
    guesses = [
        {"key": g.key, "value": g.value, "why": g.why, "doubt": g.doubt or None}
        for g in found.guesses.values()
    ]
    return {
        "experiment": str(file),
        "robot": found.urdf,
        "guesses": guesses,
        "look": list(found.notes),
        "unused_columns": list(found.rest),
    }


__all__ = ["Draft", "Wishes", "document", "draft", "init", "sorted_out"]
