"""The experiment file and the way it came: every text that it had, so that each change can be taken back.

    runs/<experiment>/studio/undo.json      the texts, which of them stands on disk, the errors measured under each

The file on disk is the truth. It is read anew before every change; a change carries the hash of the text that its author
was looking at, and is refused where another one stands there now.
"""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Callable
from pathlib import Path

from .. import bounded, config, experiment_file, loop, pipeline, state, whole_files
from ..errors import ConfigError, SysidError
from ..experiment_file import Changed
from ..specs import Experiment

_MOST, _LARGEST = 200, 1_000_000  # texts kept; bytes of one
_EDIT = "edit by hand"


def hashed(text: str) -> str:
    """SHA-256 of a text."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


class History:
    """One experiment file with its history. Safe to use from several threads."""

    def __init__(self, path: Path, out: Path | None = None):
        """Raises SysidError where the run folder cannot be written."""
        self.path = config.file_of(path)
        self.name = Experiment(path=self.path).name
        self.run = whole_files.folder(out or Path("runs") / self.name)
        self._store = whole_files.folder(self.run / "studio") / "undo.json"
        self._lock = threading.RLock()
        self._stamp = None
        self._items, self._at, self._measured, self._before = self._remembered()

    # ---- reading

    def text(self) -> str:
        """The experiment file as it is now. Raises ConfigError."""
        data = experiment_file.read(self.path)
        if len(data) > _LARGEST:
            raise ConfigError(f"an experiment file of {len(data)} bytes", where=str(self.path), allowed=f"at most {_LARGEST}")
        experiment_file.text(data, str(self.path))
        return data.decode("utf-8")  # as it stands, to the last byte: an undo brings it back

    def experiment(self, text: str) -> Experiment:
        """The experiment that a text is. Raises ConfigError."""
        return config.loads(text.removeprefix("\ufeff"), self.path)

    def sync(self) -> str:
        """The hash of the file now; an edit made elsewhere becomes a step that can be taken back. Raises ConfigError."""
        with self._lock:
            if self._stamped() != self._stamp:  # another studio was at work on the same run folder
                self._items, self._at, self._measured, self._before = self._remembered()
            text = self.text()
            if not self._items or self._items[self._at]["text"] != text:
                known = [k for k, item in enumerate(self._items) if item["text"] == text]
                if known:
                    self._at = known[-1]
                else:
                    self._append(text, _EDIT, None)
                self._save()
            return hashed(text)

    def labels(self) -> tuple[str | None, str | None]:
        """What undo and redo would do, in words; None where there is nothing."""
        with self._lock:
            undo = _said(self._items[self._at]) if self._at > 0 else None
            redo = _said(self._items[self._at + 1]) if self._at + 1 < len(self._items) else None
            return undo, redo

    def steps(self) -> list[dict]:
        """The steps up to the text that stands now, as `sysid history` has them, with those whose error is known."""
        with self._lock:
            out = list(self._before)
            for k, item in enumerate(self._items[: self._at + 1]):
                known = self._measured.get(hashed(item["text"]))
                if known and not (k == 0 and out):
                    out.append({"added": item["added"] if k else None, "joint": item["joint"] if k else None, **known, "sha": hashed(item["text"])})
            if out:
                out[0] = {**out[0], "added": None, "joint": None}
            return out

    def named(self, sha: str) -> str:
        """The step that led to the text with a hash, in words, its error not known yet."""
        with self._lock:
            item = next((item for item in reversed(self._items) if hashed(item["text"]) == sha), None)
            return "now" if item is None or item["added"] is None else _said(item)

    # ---- changing

    def change(self, seen: str, make: Callable[[str], str], added: str, joint: str | None) -> str:
        """Replace the text by what `make` makes of it; returns the new hash.

        The new text is read, its robot and its model are built, before anything is written.

        Args:
            seen: hash of the text that the change was thought for.

        Raises:
            Changed: another text stands there. SysidError: the new text cannot be meant.
        """
        with self._lock:
            text = self.as_seen(seen)
        before = text.encode("utf-8")
        new = experiment_file.edited(before, make(experiment_file.text(before))).decode("utf-8")
        pipeline.build(self.experiment(new))  # takes a while: who asks for the state need not wait
        with self._lock, state.locked(self.path):
            self.as_seen(seen)
            self._write(text, new)
            self._append(new, added, joint)
            self._save()
            return hashed(new)

    def undo(self, seen: str) -> str:
        """Restore the text before. Raises Changed, SysidError."""
        return self._move(seen, -1)

    def redo(self, seen: str) -> str:
        """Take an undo back. Raises Changed, SysidError."""
        return self._move(seen, 1)

    def measured(self, text: str, rms_test: dict, rms_train: dict) -> None:
        """Remember the errors under a text."""
        with self._lock:
            first = not self._measured and not self._before
            self._measured[hashed(text)] = {"rms_test": rms_test, "rms_train": rms_train}
            if first and self._items and self._items[0]["text"] == text:
                # steps that `sysid add` made before, where they lead to this very fit
                steps = loop.read_history(self.run)
                if len(steps) > 1 and steps[-1].get("rms_test") == rms_test:
                    self._before = steps
            self._save()
            self._tell()

    # ---- inside

    def as_seen(self, seen: str) -> str:
        """The text, where it is the one with a hash. Raises Changed."""
        now = self.sync()
        if now != seen:
            raise Changed("the experiment file changed", do="reload")
        return self._items[self._at]["text"]

    def _move(self, seen: str, by: int) -> str:
        with self._lock, state.locked(self.path):
            text = self.as_seen(seen)
            if not 0 <= self._at + by < len(self._items):
                raise SysidError("there is nothing to undo" if by < 0 else "there is nothing to redo")
            new = self._items[self._at + by]["text"]
            self._write(text, new)
            self._at += by
            self._save()
            self._tell()
            return hashed(new)

    def _write(self, old: str, new: str) -> None:
        experiment_file.replace(self.path, old.encode("utf-8"), new.encode("utf-8"))

    def _tell(self) -> None:
        """Write the steps for `sysid history`, where this page made any."""
        if any(item["added"] not in (None, _EDIT) for item in self._items):
            whole_files.write_json(self.run / "history.json", {"steps": [{k: v for k, v in step.items() if k != "sha"} for step in self.steps()]})

    def _append(self, text: str, added: str | None, joint: str | None) -> None:
        kept = self._items[: self._at + 1] if self._items else []
        first = not kept
        kept.append({"text": text, "added": None if first else added, "joint": joint})
        self._items = kept[-_MOST:]
        self._at = len(self._items) - 1

    def _save(self) -> None:
        whole_files.write_json(self._store, {"file": str(self.path.resolve()), "items": self._items, "at": self._at, "measured": self._measured, "before": self._before})
        self._stamp = self._stamped()

    def _stamped(self) -> tuple | None:
        try:
            found = self._store.stat()
            return found.st_mtime_ns, found.st_size, found.st_ino
        except OSError:
            return None

    def _remembered(self) -> tuple[list[dict], int, dict, list]:
        self._stamp = self._stamped()
        try:
            found = json.loads(bounded.read_text(self._store))
            if found.get("file", str(self.path.resolve())) != str(self.path.resolve()):
                return [], 0, {}, []  # of another experiment of the same name: its texts are not this one's
            items = [{"text": str(i["text"]), "added": i["added"], "joint": i["joint"]} for i in found["items"]]
            at = int(found["at"])
            if not 0 <= at < len(items):
                return [], 0, {}, []
            measured = {str(k): {"rms_test": dict(v["rms_test"]), "rms_train": dict(v["rms_train"])} for k, v in found["measured"].items()}
            return items, at, measured, [s for s in found["before"] if isinstance(s.get("rms_test"), dict)]
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return [], 0, {}, []


def _said(item: dict) -> str:
    on = item["joint"]
    return f"{item['added']}" + ("" if on in (None, "*") else f" on {on}")
