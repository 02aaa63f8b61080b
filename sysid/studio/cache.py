"""What was found, kept in memory by the text of the experiment file and the state of the files that it names."""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict
from pathlib import Path

from ..specs import Experiment
from .diagnosed import Diagnosed

_KEPT, _SAMPLES = 8, 4_000_000  # results in memory; samples that they hold together (at least two are kept)


class Cache:
    """What was found on all experiments; what was looked at longest ago is forgotten first. Safe to use from several threads."""

    def __init__(self):
        self._kept: OrderedDict[tuple[Path, str], Diagnosed] = OrderedDict()
        self._lock = threading.RLock()

    def keep(self, file: Path, key: str, found: Diagnosed) -> None:
        """Remember what was found on an experiment file, and forget the oldest where they grow too many."""
        with self._lock:
            for old in [k for k, v in self._kept.items() if k[0] == file and v.sha == found.sha]:
                del self._kept[old]
            self._kept[file, key] = found
            while len(self._kept) > _KEPT or (len(self._kept) > 2 and sum(v.samples for v in self._kept.values()) > _SAMPLES):
                self._kept.popitem(last=False)

    def find(self, file: Path, sha: str) -> Diagnosed | None:
        """What was found on an experiment file under the text with a hash; None where there is none, or a log or the URDF changed."""
        with self._lock:
            found = next(((k, v) for k, v in self._kept.items() if k[0] == file and v.sha == sha), None)
        if found is None or found[0][1] != key(sha, found[1].fit.experiment):
            return None
        with self._lock:
            if found[0] in self._kept:
                self._kept.move_to_end(found[0])
        return found[1]


def key(sha: str, experiment: Experiment) -> str:
    """A text's hash with the state of the files that it names."""
    names = [experiment.robot.urdf, *(name for part in (experiment.data.train, experiment.data.test) for log in part for name in log.names)]
    names += [spec.name.rpartition(":")[0] for spec in [*experiment.model.effects, *experiment.model.candidates] if ":" in spec.name]
    state = hashlib.sha256(sha.encode())
    for name in names:
        try:
            found = (experiment.folder / name).stat()
            state.update(f"{name}|{found.st_mtime_ns}|{found.st_size}\n".encode())
        except (OSError, ValueError):
            state.update(f"{name}|elsewhere\n".encode())
    return state.hexdigest()
