"""Motions that the studio designed, each in a folder of the run: runs/<experiment>/designs/NAME."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

from .. import bounded
from .. import design as designing
from ..errors import SysidError
from ..specs import Experiment
from ..statement import kept
from ..statement.words import apart

FILES = {
    "trajectory.csv": "text/csv",
    "trajectory.yaml": "application/yaml",
    "design.json": "application/json",
}
_MOST = 20  # designs that are listed


def suspects(asked) -> list[tuple[str, str]]:
    """Suspects to tell apart as a request names them, [effect:joint, ...]; none for the motion that
    tells most. Raises SysidError."""
    if asked is None:
        return []
    if not isinstance(asked, list) or not all(isinstance(one, str) and ":" in one for one in asked):
        raise SysidError("separate must be a list of effect:joint")
    return [(effect, joint) for effect, _, joint in (one.partition(":") for one in asked)]


def named(separate: list[tuple[str, str]]) -> str:
    """The name of a design's folder."""
    words = "-against-".join(f"{e}-{'robot' if j == '*' else j}" for e, j in separate)
    return re.sub(r"[^\w.-]+", "_", words)[:100] or "informative"


def made(
    experiment: Experiment, separate, duration: float, run: Path, tell: Callable[[str, float], None]
) -> None:
    """Design a motion and write its folder. Raises SysidError."""
    found = designing.design(
        experiment, separate=separate, duration=duration, processes=1, progress=tell,
        diagnosis=kept.standing(experiment, run),
    )  # fmt: skip
    designing.write(found, run / "designs" / named(separate))


def listed(run: Path) -> list[dict]:
    """The designs of a run folder: name, words, and whether each file is there."""
    out = []
    for path in sorted((run / "designs").glob("*/design.json"))[:_MOST]:
        try:
            says = _said(path, path.stat().st_mtime_ns)
            out.append({"name": path.parent.name, "says": says})
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            continue
    return out


def file(run: Path, name: str, which: str) -> str:
    """The text of a design's file. Raises SysidError: there is none."""
    if which not in FILES or not any(one["name"] == name for one in listed(run)):
        raise SysidError("there is no such design", do="reload")
    return bounded.read_text(run / "designs" / name / which)


@lru_cache(maxsize=64)
def _said(path: Path, _stamp: int) -> str:
    said = json.loads(bounded.read_text(path))
    told = [apart(pair) for pair in said["separates"]]
    fall = [s["after"] / s["now"] for s in said["expected_std"].values() if s["now"] and s["after"]]
    if not told and fall:
        fall.sort()
        told = [
            f"half of the standard deviations fall to {100 * fall[len(fall) // 2]:.0f} % or less"
        ]
    return "; ".join([f"{said['duration']:g} s of motion", *told])
