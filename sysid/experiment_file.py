"""Changing an experiment file that others may change too: nothing of theirs is ever written over.

Whoever changes a file says which bytes it read. Where others stand there now, nothing is written. What is not the
change stays: a symbolic link, the mode, a byte order mark, the end of every line that was there before.
"""

from __future__ import annotations

import os
from difflib import SequenceMatcher
from pathlib import Path

from . import bounded, whole_files
from .errors import ConfigError, SysidError

_MARK = "\ufeff"


class Changed(SysidError):
    """The file is not the one that the change was made for."""


def read(path: Path) -> bytes:
    """The bytes of an experiment file. Raises ConfigError."""
    try:
        return bounded.read_bytes(path)
    except OSError as error:
        raise ConfigError(f"the experiment file cannot be read ({error.strerror})", where=str(path), do="check its name") from None


def text(data: bytes, where: str = "") -> str:
    """The text of an experiment file without a byte order mark, its lines ended by line feeds. Raises ConfigError."""
    try:
        found = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ConfigError("not UTF-8 text", where=where, do="give an experiment in YAML") from None
    return found.replace("\r\n", "\n")


def edited(before: bytes, after: str) -> bytes:
    """A new text with what the old one had: its byte order mark, and the end of each line that stays; a new line ends as
    most of the others do."""
    old = before.decode("utf-8")
    mark, old = (_MARK, old[1:]) if old.startswith(_MARK) else ("", old)
    there, new = old.splitlines(keepends=True), after.splitlines(keepends=True)
    usual = "\r\n" if 2 * sum(line.endswith("\r\n") for line in there) > len(there) else "\n"
    bare = [line.replace("\r\n", "\n") for line in there]
    out = []
    for what, i, j, k, m in SequenceMatcher(None, bare, new, autojunk=False).get_opcodes():
        if what == "equal":
            out += there[i:j]
        else:
            out += [line[:-1] + usual if line.endswith("\n") else line for line in new[k:m]]
    return (mark + "".join(out)).encode("utf-8")


def grafted(text: str, rewritten: str, changed: str) -> str:
    """A change made in a text itself, that was made in how a writer of YAML would write it: lines that stay keep their
    indentation and their spaces. Where the writer did more than move words, `changed`.

    Args:
        rewritten: the text as the writer writes it. changed: the same with the change.
    """
    old, bare, new = text.splitlines(), rewritten.splitlines(), changed.splitlines()
    if [line.split() for line in old] != [line.split() for line in bare]:
        return changed
    out = []
    for what, i, j, k, m in SequenceMatcher(None, bare, new, autojunk=False).get_opcodes():
        if what == "equal":
            out += old[i:j]
            continue
        before = [n for n in range(min(j, len(bare)) - 1, -1, -1) if bare[n].strip()[:1] not in ("", "#")]
        for line in new[k:m]:
            # a new line stands as far in as the last before it that stood beside it
            beside = [n for n in before if _indent(bare[n]) == _indent(line)] or before
            further = _indent(old[beside[0]]) - _indent(bare[beside[0]]) if beside else 0
            out.append(" " * max(_indent(line) + further, 0) + line.lstrip(" ") if line.strip() else line)
    return "\n".join(out) + "\n"


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip(" "))


def replace(path: Path, before: bytes, after: bytes) -> None:
    """Write `after` into a file that holds `before`; the caller holds `state.locked(path)`.

    Raises:
        Changed: it holds something else. SysidError: the disk refuses.
    """
    if read(path) != before:
        raise Changed("the experiment file changed meanwhile, and nothing was written into it", where=str(path), do="run the command again")
    # through a symbolic link: the link stays, what it names is replaced
    whole_files.write_atomically(Path(os.path.realpath(path)), lambda p: p.write_bytes(after))
