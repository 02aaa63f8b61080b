"""What the user should know of: a warning, or a line of who collects them.

Python's own filters of warnings are one for all threads of a process: a fit and a preview beside it, each of which
collected with them, took each other's lines and put each other's filters back. What collects here is the context's own.
"""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from .errors import SysidWarning

_COLLECTING: ContextVar[list[str] | None] = ContextVar("collecting", default=None)
_FILTERS = threading.RLock()  # of Python: one thread at a time changes them


def warn(text: str, *, above: int = 1) -> None:
    """Tell the user of something that was decided for them.

    Args:
        text: one sentence. above: how many calls above the caller's is whose line a warning names.
    """
    told = _COLLECTING.get()
    if told is None:
        warnings.warn(SysidWarning(text), stacklevel=above + 2)
    elif text not in told:
        told.append(text)


@contextmanager
def noticed() -> Iterator[list[str]]:
    """Collect what the user is told within, each once; other threads' goes its own way."""
    told: list[str] = []
    token = _COLLECTING.set(told)
    try:
        yield told
    finally:
        _COLLECTING.reset(token)


@contextmanager
def unheard() -> Iterator[None]:
    """Let other packages' warnings go, within a few lines that start no work of ours."""
    with _FILTERS, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
