"""Finished runs on disk, so that a study that was killed goes on where it was.

One JSON line a finished run, after a first line that states the settings. A study with other settings starts
anew; half a line, which is what a kill leaves, is dropped. Results come back from the file exactly as they went in
(JSON keeps every digit of a float), so a resumed study ends in the same bytes as an uninterrupted one.
"""

import json
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

from ..errors import SysidError


class Journal:
    """The journal at `path` for a study with `settings`; `done` holds the finished runs by key."""

    def __init__(self, path: Path, settings: dict):
        self.path, self.done = path, {}
        head = json.dumps({"settings": settings}, sort_keys=True)
        try:
            lines = path.read_text(encoding="utf-8").split("\n") if path.exists() else []
        except (OSError, UnicodeDecodeError):
            lines = []
        if lines and lines[0] == head:
            for line in lines[1:]:
                try:
                    entry = json.loads(line)
                    self.done[entry["key"]] = entry["result"]
                except (ValueError, KeyError, TypeError):
                    continue
        try:
            whole = [head, *(json.dumps({"key": key, "result": result}) for key, result in self.done.items())]
            temporary = path.with_name(path.name + ".new")
            temporary.write_text("\n".join(whole) + "\n", encoding="utf-8")
            temporary.replace(path)
            self._file = path.open("a", encoding="utf-8")
        except OSError as error:
            raise SysidError(f"cannot be written ({error.strerror})", where=str(path), do="give another folder with --out") from None

    def add(self, key: str, result: dict) -> None:
        """Record a finished run, on disk before this returns."""
        self.done[key] = result
        try:
            self._file.write(json.dumps({"key": key, "result": result}) + "\n")
            self._file.flush()
        except OSError as error:
            raise SysidError(f"cannot be written ({error.strerror})", where=str(self.path), do="free the disk and run it again: it goes on from here") from None

    def close(self) -> None:
        """Close the file; the journal stays readable."""
        with suppress(OSError):  # what a full disk refused is refused once more
            self._file.close()


def run(
    journal: Journal, tasks: Iterable[tuple[str, tuple]], work: Callable[..., dict], *, jobs: int = 1,
    progress: Callable[[float], None] | None = None,
) -> dict[str, dict]:  # fmt: skip
    """Do every task that the journal lacks, in `jobs` processes; returns all results by key.

    Args:
        tasks: (key, arguments of `work`). work: a module-level function, deterministic in its arguments.
    """
    tasks = list(tasks)
    waiting = [(key, arguments) for key, arguments in tasks if key not in journal.done]
    tell = progress or (lambda share: None)
    finished = len(tasks) - len(waiting)
    try:
        if jobs == 1:
            results = ((key, work(*arguments)) for key, arguments in waiting)
        else:
            from joblib import Parallel, delayed

            results = Parallel(n_jobs=jobs, return_as="generator_unordered")(delayed(_named)(key, work, arguments) for key, arguments in waiting)
        for key, result in results:
            journal.add(key, result)
            finished += 1
            tell(finished / len(tasks))
    finally:
        journal.close()
    return {key: journal.done[key] for key, _ in tasks}


def _named(key: str, work: Callable[..., dict], arguments: tuple) -> tuple[str, dict]:
    return key, work(*arguments)
