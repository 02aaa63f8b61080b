"""What a study has done, from its journal, and the rest of it done."""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path


def results(
    path: Path, settings: dict, tasks: list[tuple[str, tuple]], work: Callable[..., dict], *, jobs: int, more: bool
) -> list[dict]:  # fmt: skip
    """The results of a study's tasks.

    Args:
        path, settings: of its journal. tasks, work, jobs: as of `sysid.studies.journal.run`. more:
            do what is not done; without it, what is done is looked at, and nothing is written.
    """
    from sysid.studies.journal import Journal, run

    if not more:
        # of a copy: a journal that is opened is written anew, and another process may be at it
        with tempfile.TemporaryDirectory() as place:
            copy = shutil.copy(path, place) if path.exists() else Path(place) / path.name
            return list(Journal(Path(copy), settings).done.values())
    say = lambda share: print(f"{share:.0%}", file=sys.stderr, flush=True)  # noqa: E731
    return list(run(Journal(path, settings), tasks, work, jobs=jobs, progress=say).values())
