"""What is remembered of a user between runs, outside every experiment's folder: locks, and which Python files are trusted.

    <state>/locks/<sha256 of a path>.lock
    <state>/trusted/<sha256 of a file>

<state> is the user's state folder, ~/.local/state/sysid on Linux (XDG_STATE_HOME). A stranger's folder of experiments
holds nothing of it.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import SysidError

_WAIT = 60.0  # s: a lock is held while files are written, never while anything is calculated


def folder(name: str) -> Path | None:
    """A folder of the state, made where it is not there; None where this user can keep none (no home, a read-only disk)."""
    from platformdirs import user_state_path

    path = user_state_path("sysid", appauthor=False) / name
    try:
        # without a home the path is relative: it would land wherever the command was typed
        if not path.is_absolute():
            return None
        path.mkdir(parents=True, exist_ok=True, mode=0o700)
    except (OSError, RuntimeError):
        return None
    return path if os.access(path, os.W_OK) else None


def _places() -> Iterator[Path]:
    """Folders for locks: the user's own; where there is none, or its file system has no locks, one in the temporary folder."""
    if (own := folder("locks")) is not None:
        yield own
    path = Path(tempfile.gettempdir()) / f"sysid-locks-{os.getuid() if hasattr(os, 'getuid') else 'user'}"
    with suppress(OSError):
        path.mkdir(mode=0o700, exist_ok=True)
        yield path


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Keep every other process of this user that asks for the same file out, until the block ends or the process dies.

    Where no lock can be had at all, the block goes on without: what it writes is compared with what it read in any case.

    Raises:
        SysidError: another holds it for a minute.
    """
    from filelock import FileLock, Timeout

    name = hashlib.sha256(os.fsencode(os.path.realpath(path))).hexdigest()[:32]
    held = None
    for place in _places():
        try:
            # one object for each file: a thread that holds it already goes on
            held = FileLock(place / f"{name}.lock", is_singleton=True)
            held.acquire(timeout=_WAIT)
            break
        except Timeout:
            raise SysidError("another sysid is writing it", where=str(path), do="wait until it is done") from None
        except (OSError, NotImplementedError):
            held = None
    try:
        yield
    finally:
        if held is not None:
            held.release()
