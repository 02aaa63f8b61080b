"""Which Python files may run: those whose content this user has allowed, each once.

A Python file that an experiment names can do all that its user can. So it runs only where somebody has said so: the
SHA-256 of what it holds is remembered in the user's own state folder, beside no experiment. A file that changes by one
byte is another file, and is asked for again.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from . import bounded, state
from .errors import ConfigError

_ALLOWED: set[str] = set()  # in this process, also where nothing can be remembered


class Untrusted(ConfigError):
    """A Python file that would have to run, and that nobody has allowed. `path` and `content` are what to ask about."""

    def __init__(self, path: Path, content: bytes):
        super().__init__(
            "this Python file, which the experiment names, was not allowed to run; it could do all that you can", where=str(path),
            do="read it, then give --trust once (from Python: sysid.trust(FILE))",
        )  # fmt: skip
        self.path, self.content = path, content


def check(path: Path, content: bytes) -> None:
    """Raises Untrusted: nobody has allowed a file of this content."""
    name = hashlib.sha256(content).hexdigest()
    if name in _ALLOWED:
        return
    remembered = state.folder("trusted")
    if remembered is None or not (remembered / name).is_file():
        raise Untrusted(path, content)


def allow(path: Path, content: bytes) -> None:
    """Let a file of this content run, now and in every later command of this user."""
    name = hashlib.sha256(content).hexdigest()
    _ALLOWED.add(name)
    remembered = state.folder("trusted")
    if remembered is not None:
        try:
            (remembered / name).write_text(f"{path}\n", encoding="utf-8", errors="replace")
        except OSError:
            pass  # a full disk: it is allowed for this time


def trust(file: str | Path) -> None:
    """Let a Python file of own effects run, as it is now. Raises ConfigError: it cannot be read."""
    path = Path(file)
    try:
        allow(path.resolve(), bounded.read_bytes(path))
    except OSError as error:
        raise ConfigError(f"the file cannot be read ({error.strerror})", where=str(path), do="check its name") from None
