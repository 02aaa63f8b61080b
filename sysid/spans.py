"""A long log as spans: what is read, looked at and filtered at a time, so that memory does not grow
with the log.

A span has a fixed number of rows, whatever fits in memory: what is usual in a log (for events, for
jumps of accelerations, for the noise of its angles) is what is usual in a span of it. Filters see
beyond its ends: a span is read with as many rows of its neighbours as they need, and these stand
outside its `core`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from .free_memory import kept, released
from .segment import Segment

SPAN = 2**18  # rows; at 1 kHz four minutes
_PARTS = 8  # of a span, where a log is looked at in parts: half a minute
_FREE, _APART = 2**24, 2**23  # bytes: of signals of all joints over a span, an array is apart
_SHORTEST = 64  # parts of a span: of one of very many logs, that are still four seconds

#: (first, last) -> those rows of a stretch without a gap
Rows = Callable[[int, int], Segment]


class Spans(Sequence):
    """The segments of a long log, each read when it is asked for; neighbours of one stretch meet.

    Args:
        stretches: of each stretch without a gap, what reads its rows, and how many it has.
    """

    def __init__(self, stretches: Sequence[tuple[Rows, int]]) -> None:
        kept(_FREE, _APART)
        self._spans = [
            (rows, first, last, n) for rows, n in stretches for first, last in pairwise(edges(n))
        ]
        self.samples = sum(n for _, n in stretches)

    def __len__(self) -> int:
        return len(self._spans)

    def __getitem__(self, number):
        return self.around(number, 0)

    @property
    def stretches(self) -> int:
        """How many stretches without a gap there are."""
        return len({id(rows) for rows, *_ in self._spans})

    @property
    def held(self) -> bool:
        """Whether rows stand in this process's memory, where another cannot read them."""
        return any(isinstance(rows, Held) for rows, *_ in self._spans)

    def clocks(self) -> list[tuple[float, float]]:
        """First and last time [s] of each stretch without a gap."""
        whole = {id(rows): (rows, n) for rows, _, _, n in self._spans}
        return [(float(rows(0, 2).t[0]), float(rows(n - 2, n).t[-1])) for rows, n in whole.values()]

    def middle(self, most: int) -> Segment:
        """The middle of the longest stretch, of at most so many rows."""
        rows, _, _, n = max(self._spans, key=lambda span: span[3])
        return rows(max((n - most) // 2, 0), min((n + most) // 2, n))

    def spread(self, most: int) -> tuple[Segment, ...]:
        """All rows, a segment for each stretch without a gap; or, where there are more than `most`,
        about so many in evenly spaced parts, the first and the last among them."""
        whole = {id(rows): (rows, n) for rows, _, _, n in self._spans}.values()
        if self.samples <= most:
            return tuple(rows(0, n) for rows, n in whole)
        # of one of many logs shorter parts: all together are no more than are asked for
        size = min(SPAN // _PARTS, max(most // 2, SPAN // _SHORTEST))
        parts = [(rows, own) for rows, n in whole for own in pairwise(edges(n, size))]
        count = min(max(2, most // size), len(parts))
        chosen = [k * (len(parts) - 1) // (count - 1) for k in range(count)]
        return tuple(rows(*own) for rows, own in (parts[k] for k in dict.fromkeys(chosen)))

    def step(self, number: int) -> float:
        """Seconds between a span's rows."""
        rows, first, *_ = self._spans[number]
        return rows(first, first + 2).step

    def carried(self, number: int, margin: int) -> tuple[Sequence[Segment], int]:
        """Segments for another process, among which a span with such margins is, and its number:
        where a file can be read, how; where it cannot, the rows."""
        if isinstance(self._spans[number][0], Held):
            return (self.around(number, margin),), 0
        return self, number

    def measured(self, number: int) -> Segment:
        """A span as it was measured, where what reads it makes more of it."""
        rows, first, last, _ = self._spans[number]
        return getattr(rows, "measured", rows)(first, last)

    def around(self, number: int, margin: int) -> Segment:
        """A span with up to `margin` rows of what stands before and after it, outside its core."""
        rows, first, last, n = self._spans[number]
        begin, end = max(0, first - margin), min(n, last + margin)
        read = rows(begin, end)
        released()
        return replace(read, core=slice(first - begin, last - begin))


def edges(n: int, most: int | None = None) -> list[int]:
    """Where the spans of n rows begin, and the end: each has `most` rows (`SPAN`), but the last two,
    which are of equal length, so that none is short. So what a span takes of memory is the same
    whatever the log's length."""
    most = most or SPAN
    whole = max(-(-n // most) - 2, 0)
    rest = n - whole * most
    count = -(-rest // most)
    return [
        *(k * most for k in range(whole)),
        *(whole * most + rest * k // count for k in range(count + 1)),
    ]


def carried(segments: Sequence[Segment], number: int, margin: int) -> tuple[Sequence[Segment], int]:
    """Of any log, segments for another process and the number there of one of them, with its
    margins where it is a span."""
    if isinstance(segments, Spans):
        return segments.carried(number, margin)
    return (segments[number],), 0


def around(segments: Sequence[Segment], number: int, margin: int) -> Segment:
    """A segment of any log, with up to `margin` rows about its core where it is a span."""
    return segments.around(number, margin) if isinstance(segments, Spans) else segments[number]


def clocks(segments: Sequence[Segment]) -> list[tuple[float, float]]:
    """First and last time [s] of each stretch of any log that has no gap."""
    if isinstance(segments, Spans):
        return segments.clocks()
    return [(float(segment.t[0]), float(segment.t[-1])) for segment in segments]


def of_segment(segment: Segment) -> tuple[Rows, int]:
    """What reads the rows of a segment that is in memory, and how many it has."""

    return Held(segment), len(segment.t)


@dataclass(frozen=True)
class Held:
    """The rows of a segment that is in memory."""

    segment: Segment

    def __call__(self, first: int, last: int) -> Segment:
        part, own = slice(first, last), self.segment
        cut = lambda values: None if values is None else values[part]  # noqa: E731
        signals = {name: values[part] for name, values in own.signals.items()}
        arrays = {name: cut(getattr(own, name)) for name in ("t", "q", "tau", "qd", "qdd")}
        return replace(own, **arrays, signals=signals, core=None)
