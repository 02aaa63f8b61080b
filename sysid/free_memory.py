"""What the C library does with memory that is free: how much of it stays with the process."""

from __future__ import annotations

from contextlib import suppress
from ctypes import CDLL
from functools import cache

_TRIM, _MMAP = -1, -3  # M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of glibc's malloc.h (man mallopt)
_said = list[tuple[int, int]]()

#: Before Polars is loaded: its own allocator (jemalloc) keeps what is free for ten seconds, of each
#: of its arenas. What a span's columns took would stand beside what is made of them.
POLARS = "_RJEM_MALLOC_CONF", "narenas:1,dirty_decay_ms:5,muzzy_decay_ms:0"


def kept(free: int, apart: int) -> None:
    """Say once in a process, the first time, how much stays with it.

    Without it the C library moves both with what is freed: arrays of a span then come from the
    heap, leave holes in it, and those of the next span do not fit in these.

    Args:
        free: bytes of the heap that may be free at its end. apart: arrays of so many bytes are
            apart from the heap, and go back to the system when they are freed.
    """
    if _said:
        return
    _said.append((free, apart))
    with suppress(AttributeError, OSError, TypeError):
        library = CDLL(None)
        library.mallopt(_TRIM, free)
        library.mallopt(_MMAP, apart)


@cache
def _trim():
    """The C library's way to give back what is free; nothing where it has none."""
    try:
        return CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):
        return lambda _: None


def released() -> None:
    """Give what is free back to the system, between one part of the work on a span and the next:
    what the C library keeps is in pieces, and would grow from span to span."""
    _trim()(0)
