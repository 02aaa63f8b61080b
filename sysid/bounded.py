"""Reading small files that others wrote: a pipe or a device never ends, and a huge file would fill the memory."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

_MOST = 200_000_000  # bytes; the largest file read whole is a run's fit.json


def read_bytes(path: Path, most: int = _MOST) -> bytes:
    """The bytes of a file. Raises OSError, as `Path.read_bytes`: also where it is no plain file, or of more than `most` bytes."""
    # opening a pipe would wait for whoever writes into it
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(handle, "rb") as file:
        found = os.fstat(handle)
        if stat.S_ISDIR(found.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if not stat.S_ISREG(found.st_mode):
            raise OSError(errno.EINVAL, "a pipe or a device, no plain file", str(path))
        if found.st_size > most:
            raise OSError(errno.EFBIG, f"{found.st_size} bytes, more than {most}", str(path))
        return file.read(most + 1)


def read_text(path: Path, most: int = _MOST) -> str:
    """The text of a file in UTF-8. Raises OSError, as `read_bytes`; UnicodeDecodeError."""
    return read_bytes(path, most).decode("utf-8")
