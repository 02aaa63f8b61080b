"""Names for what is not finished, and the end of it where the process that made it was killed.

A temporary name says which process fills it: of which machine, among which processes (a container
has its own), its number. The next process that wants a name of that kind removes those whose
process is gone.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import tempfile
import uuid
import weakref
from contextlib import suppress
from functools import cache
from pathlib import Path


def beside(path: Path) -> Path:
    """A name beside a path to fill before it is renamed. What processes of this machine that were
    killed left of that kind is removed."""
    kind = f".{path.name[:100]}."
    with suppress(OSError):
        for old in list(path.parent.iterdir()):
            host, _, process = old.name.removeprefix(kind).partition("-")
            number = process.partition("-")[0]
            if (
                old.name.startswith(kind)
                and host == _here()
                and number.isdigit()
                and not _alive(int(number))
            ):
                with suppress(OSError):  # another user's, or removed meanwhile
                    shutil.rmtree(old) if old.is_dir() else old.unlink()
    return path.with_name(f"{kind}{_here()}-{os.getpid()}-{uuid.uuid4().hex[:8]}")


def temporary_folder(owner: object) -> Path:
    """A new folder among the temporary ones, for this user alone. It goes with its owner; that of a
    killed process goes when the next one is made. Raises OSError."""
    path = beside(Path(tempfile.gettempdir()) / "sysid")
    path.mkdir(mode=0o700)
    weakref.finalize(owner, shutil.rmtree, path, ignore_errors=True)
    return path


@cache
def _here() -> str:
    """This machine and, on Linux, the set of processes whose numbers are known here: of two
    containers that share a folder and a name, neither takes the other's processes for dead."""
    try:
        among = os.readlink("/proc/self/ns/pid")
    except OSError:
        among = ""
    return hashlib.sha256(f"{platform.node()}{among}".encode()).hexdigest()[:8]


def _alive(process: int) -> bool:
    if os.name != "posix":
        return True  # asking would end it
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True
