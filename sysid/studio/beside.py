"""What can be laid over a fit: an earlier step, a change that was previewed, another run."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from .. import bounded
from ..errors import SysidError
from ..estimate import Fit
from ..prediction import Prediction
from ..run import read_run
from .diagnosed import step_name
from .rows import Columns

_MOST = 40  # run folders that are offered


@dataclass(frozen=True)
class OtherRun:
    """Another run folder of the same joints, as `sysid fit`, `add` or `discover` wrote it."""

    name: str
    folder: Path

    def prediction(self, part: str) -> Prediction:
        """Measured and predicted torque. Raises SysidError: the folder holds no fit."""
        return _predicted(self.folder, self._stamp(), part)

    def told(self, part: str) -> list[float | None]:
        """The RMS of each joint. Raises SysidError, as `prediction`."""
        return _told(self.folder, self._stamp(), part)

    def times(self, part: str) -> np.ndarray:
        """(n,) of its rows [s]. Raises SysidError, as `prediction`."""
        return self.prediction(part).t

    def columns(self, part: str, joint: int) -> Columns:
        """What it says of a joint. Raises SysidError, as `prediction`."""
        return self.prediction(part).of_joint(joint)

    def _stamp(self) -> int:
        return (self.folder / "predictions.parquet").stat().st_mtime_ns


@lru_cache(maxsize=8)
def _predicted(folder: Path, _stamp: int, part: str) -> Prediction:
    return read_run(folder).prediction(part)


@lru_cache(maxsize=32)
def _told(folder: Path, _stamp: int, part: str) -> list[float | None]:
    return list(read_run(folder).rms(part).values())


def runs(run: Path, joints: tuple[str, ...]) -> list[OtherRun]:
    """The run folders within a run folder and beside it whose robots have the same joints."""
    found = []
    for pattern, place in (("steps/*", run), ("*", run.parent), ("*/steps/*", run.parent)):
        for path in sorted(place.glob(f"{pattern}/fit.json"))[:_MOST]:
            folder = path.parent
            if folder.resolve() == run.resolve() or any(folder == one.folder for one in found):
                continue
            if (folder / "predictions.parquet").is_file() and _joints(path) == joints:
                name = folder.relative_to(place if place == run else run.parent).as_posix()
                found.append(OtherRun(name, folder))
    return found[:_MOST]


def run_named(run: Path, joints: tuple[str, ...], name: str) -> OtherRun:
    """One of `runs` by its name. Raises SysidError: there is none."""
    for one in runs(run, joints):
        if one.name == name:
            return one
    raise SysidError("there is no such run", do="reload")


def led(steps: list[dict], sha: str, last: str, fit: Fit) -> dict:
    """The steps that led to a text, in words, itself the last; and what the last did to each
    joint's held-out error: first the joints that it was of, then where the error moved most.

    Args:
        steps: of the history. sha, last: the text's hash, and what its step is called where the
            history does not know its error yet.
    """
    names = [step_name(s) for s in steps]
    before = [s for s in steps if s.get("sha") != sha]
    if len(before) == len(steps):
        names.append(last)
    own = names[-1].rpartition(" on ")[2].split(", ")  # joints that the last step changed
    was, now = before[-1]["rms_test"] if before else {}, fit.rms("test")
    falls = [
        {"joint": joint, "unit": unit, "from": was[joint], "to": now[joint]}
        for joint, unit in zip(fit.joints, fit.predictions["test"].units)
        if was.get(joint) and now[joint]
    ]
    moved = lambda f: abs(f["to"] / f["from"] - 1.0)  # noqa: E731
    falls.sort(key=lambda f: (f["joint"] not in own, -moved(f)))
    return {"steps": names, "falls": falls}


def _joints(path: Path) -> tuple[str, ...] | None:
    try:
        return _said(path, path.stat().st_mtime_ns)
    except OSError:
        return None


@lru_cache(maxsize=256)
def _said(path: Path, _stamp: int) -> tuple[str, ...] | None:
    try:
        return tuple(json.loads(bounded.read_text(path))["robot"]["joints"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
