"""The experiments that a studio was opened on: the one that was named, and those beside it.

The page names them by number. No path of a request reaches the disk; which there are is settled at the start.
"""

from __future__ import annotations

import re
import threading
from pathlib import Path

from ..errors import SysidError
from ..specs import Experiment
from .cache import Cache
from .session import Session
from .turn import Turn

_LOOKED_AT = 100_000  # bytes of a file, to see whether it is an experiment


class Absent(SysidError):
    """There is no experiment with that number."""


class Experiments:
    """Experiments by number, the first is the one that was named. Safe to use from several threads."""

    def __init__(self, paths: list[Path], out: Path | None = None):
        self._paths, self._out = paths, out
        self.names = [Experiment(path=path).name for path in paths]
        self._sessions: dict[int, Session] = {}
        self._cache, self._turn, self._lock = Cache(), Turn(), threading.Lock()

    @classmethod
    def of(cls, session: Session) -> Experiments:
        """One experiment that is open already."""
        experiments = cls([session.history.path])
        experiments._sessions[0] = session
        return experiments

    def session(self, number: int) -> Session:
        """The experiment with a number, opened when it is first asked for. Raises Absent, SysidError."""
        if not 0 <= number < len(self._paths):
            raise Absent("there is no such experiment", do="go back to the first")
        with self._lock:
            if number not in self._sessions:
                # two experiments never share a run folder that was given for one
                out = self._out if self._out is None or number == 0 else self._out / self.names[number]
                self._sessions[number] = Session(self._paths[number], out, cache=self._cache, turn=self._turn)
            return self._sessions[number]

    def opened(self, number: int) -> Session | None:
        """The experiment with a number where it is open already; never waits."""
        return self._sessions.get(number)

    def cancel(self) -> None:
        """Ask every job to stop."""
        with self._lock:
            for session in self._sessions.values():
                session.worker.cancel()


def beside(path: Path) -> list[Path]:
    """An experiment file and those in its folder; of a folder without a config.yaml, what it and its own folders hold."""
    folder = path.parent
    found = [file for kind in ("*.yaml", "*.yml") for file in folder.glob(kind)]
    if path.is_file():
        return [path, *(file for file in sorted(found) if file != path and _is_experiment(file))]
    if path.name != "config.yaml":
        return [path]
    found += folder.glob("*/config.yaml")
    return [file for file in sorted(found) if _is_experiment(file)] or [path]


def _is_experiment(path: Path) -> bool:
    """Whether a file names a robot, as every experiment does."""
    try:
        with path.open("rb") as file:
            return re.search(rb"^robot\s*:", file.read(_LOOKED_AT), re.MULTILINE) is not None
    except OSError:
        return False
