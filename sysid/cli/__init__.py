"""The commands: they parse, call, print. Nothing is computed here."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import NoReturn

import typer

from ..errors import SysidError
from . import adding, catalogues, designing, diagnosing, first_steps, fleets, simulating  # noqa: F401 - each puts its commands into app
from .command_line import TRUSTED, app
from .studies import study

app.add_typer(study, name="study")

_INTERRUPTED = 130


def main() -> None:
    """The `sysid` command: bad input is one line on standard error and exit status 2."""
    from ..trusted import Untrusted, allow

    try:
        while True:
            try:
                status = app(prog_name="sysid", standalone_mode=False)
                if sys.stdout is not None:  # closed
                    sys.stdout.flush()
                break
            except Untrusted as error:
                if not (TRUSTED["given"] or _allowed(error)):
                    raise
                allow(error.path, error.content)  # and from the start: no work was done
    except SysidError as error:
        _fail(str(error), 2)
    except typer.Exit as stop:
        status = stop.exit_code
    except (KeyboardInterrupt, typer.Abort):
        status = _INTERRUPTED
    except BrokenPipeError:
        _drop(sys.stdout)
        status = 1
    except OSError as error:  # a full disk under the output, or under a file that nobody minds
        _drop(sys.stdout)
        _fail(f"{error.filename or 'the output'} cannot be written or read ({error.strerror or error})", 1)
    except MemoryError:
        _fail("out of memory", 1)
    except Exception as error:
        # what click raises for a mistyped command carries its own status and message
        if hasattr(error, "format_message"):
            from ..mistyped import said

            _fail(said(error), getattr(error, "exit_code", 2))
        if not _of_ctrl_c(error):
            if os.environ.get("SYSID_DEBUG"):
                raise
            _fail(f"internal error, {type(error).__name__}: {error}; SYSID_DEBUG=1 shows where", 1)
        status = _INTERRUPTED
    if status == _INTERRUPTED:  # typer makes an exit of Ctrl-C and says nothing
        _fail(f"interrupted; {_kept(sys.argv[1:])}", _INTERRUPTED)
    _end(status if isinstance(status, int) else 0)


def _of_ctrl_c(error: BaseException | None) -> bool:
    """Whether an error comes of Ctrl-C: a library that is imported then says that it cannot begin."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _allowed(untrusted) -> bool:
    """Ask, where somebody is there to answer."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    said = f"{untrusted.path}\nThe experiment names this Python file. It runs with all that you may do: read it first.\nLet it run, now and whenever it is as it is now? [y/N] "
    print(said, end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _kept(words: list[str]) -> str:
    """What of a command is there after Ctrl-C."""
    command = next((word for word in words if not word.startswith("-")), "")
    return {
        "study": "what was finished is kept, run it again to go on", "discover": "the steps that were shown are kept",
        "fetch": "the files that came whole are kept",
    }.get(command, "nothing was written")  # fmt: skip


def _drop(stream) -> None:
    """Let nothing more be written to a standard stream: Python would try again when it ends."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _fail(message: str, status: int) -> None:
    with suppress(OSError):  # nobody can be told
        print("sysid: " + " ".join(str(message).split()), file=sys.stderr)
    _end(status)


def _end(status: int) -> NoReturn:
    """Leave with a status, also where what is still to be said cannot be written: Python would leave with its own."""
    try:
        if sys.stderr is not None:  # closed
            sys.stderr.flush()
    except OSError:  # nobody can be told
        _drop(sys.stderr)
    sys.exit(status)
