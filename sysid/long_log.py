"""A long log read span by span, wherever its file can be: its clock in a first pass, its signals
when they are asked for.

A file can where it is Parquet, its clock is even (gaps aside), no recording ends in it, and values come
as often as rows. Any other is read whole, as a short one is, and then looked at in the same spans.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from . import log as logs
from . import recorded_columns, recording, spans, units
from .even_clock import EvenClock, Stretch
from .full_turns import going_on
from .groups import levels_of
from .held_rows import seldom
from .log import Log
from .log_spec import DataSpec, LogSpec
from .segment import Segment
from .spans import Spans, edges, of_segment
from .warned import noticed, warn

_LOOKED = 20_000  # rows that tell how often values come
_DEGREES = re.compile(r"joint '.*' reaches")  # a notice whose number differs from span to span


def read(
    log: LogSpec,
    data: DataSpec,
    joints: tuple[str, ...],
    prismatic,
    folder: Path = Path(),
    actuators=logs.NO_ACTUATORS,
) -> Log:
    """As `log.read`; the segments of a long log are spans of it. Raises LogError."""
    how = (log, data, joints, prismatic, folder, actuators)
    found = in_spans(*how)
    return spanned(logs.read(*how)) if found is None else found


def in_spans(log: LogSpec, *how) -> Log | None:
    """A log whose file is read span by span; None where it is short, or has to be read whole.

    Args:
        how: what else `read` is given.
    """
    source = _source(log, *how)
    return None if source is None else source.log()


def in_parts(log: LogSpec, *how) -> bool:
    """Whether a log's file is long, and can be read in parts.

    Args:
        how: what else `read` is given.
    """
    return _source(log, *how) is not None


def spanned(log: Log) -> Log:
    """A log that is in memory, in spans where it is long and its clock is even."""
    if max((len(s.t) for s in log.segments), default=0) <= spans.SPAN or any(
        s.clock is not None for s in log.segments
    ):
        return log
    return replace(log, segments=Spans([of_segment(segment) for segment in log.segments]))


def _source(
    log: LogSpec, data: DataSpec, joints, prismatic, folder: Path, actuators
) -> _Source | None:
    """What reads a file span by span; None where it cannot be, or is short."""
    if actuators or len(log.names) > 1:
        return None
    table = recording.table_of(log.names[0], log, folder)
    if table.rows is None or table.rows <= spans.SPAN or table.has(recording.EPISODE):
        return None
    return _Source(log, data, joints, prismatic, folder, table)


@dataclass(frozen=True)
class _Rows:
    """What reads the rows of a stretch, in whichever process."""

    source: _Source
    stretch: Stretch

    def __call__(self, first: int, last: int) -> Segment:
        return self.source.rows(self.stretch, first, last)

    def measured(self, first: int, last: int) -> Segment:
        """The same with angles that jump by a turn."""
        return self.source.rows(self.stretch, first, last, wrapped=True)


class _Source:
    """One Parquet file and how it is read."""

    def __init__(
        self, log: LogSpec, data: DataSpec, joints, prismatic, folder: Path, table
    ) -> None:
        self._spec, self._data, self._joints, self._prismatic, self._folder = (
            log,
            data,
            joints,
            prismatic,
            folder,
        )
        self._table, self._told = table, set()

    def log(self) -> Log | None:
        """The log; None where its clock is not even, or values come more seldom than rows."""
        found = self._stretches()
        if found is None or seldom(
            self._samples(found[0], 0, min(found[0].rows, _LOOKED, spans.SPAN))
        ):
            return None
        stretches = [(_Rows(self, one), one.rows) for one in found]
        digest = logs.sha256(self._table.path)
        name, groups = self._spec.name, levels_of(self._data.groups, self._spec)
        return Log(
            name, self._table.path, digest, Spans(stretches), hashes={name: digest},
            unused=tuple(self._data.unused), levels=groups,
        )  # fmt: skip

    def rows(self, stretch: Stretch, first: int, last: int, wrapped: bool = False) -> Segment:
        """Rows of a stretch, whose angles go on where they jump by a turn, or are `wrapped`."""
        samples = self._samples(stretch, first, last, wrapped)
        t = stretch.begin + stretch.step * np.arange(first, last)
        return logs.segment(t, stretch.step, samples.signals)

    def _samples(
        self, stretch: Stretch, first: int, last: int, wrapped: bool = False
    ) -> recording.Recording:
        row = stretch.row + first
        part = self._table.between(row, stretch.row + last)
        spec = self._spec.model_copy(update={"start": None, "stop": None})
        with noticed() as told:
            how = (spec, self._data, self._joints, self._prismatic, self._folder)
            samples = logs.measured(*how, table=part, first=row)
            if not wrapped:
                samples = going_on(samples, self._joints, self._prismatic)
        for said in told:
            key = found[0] if (found := _DEGREES.findall(said)) else said
            if key not in self._told:
                self._told.add(key)
                warn(said)
        return samples

    def _stretches(self) -> list[Stretch] | None:
        """The stretches without a gap of the piece that is asked for; None where its clock is not
        even, or it is short."""
        start, stop = self._spec.start or 0.0, self._spec.stop
        if rate := self._data.rate:
            first = int(np.ceil(start * rate - 1e-9))
            end = self._table.rows if stop is None else int(np.ceil(stop * rate - 1e-9))
            last = min(end, self._table.rows)
            long = last - first > spans.SPAN
            return [Stretch(first, last - first, first / rate, 1.0 / rate)] if long else None
        clock, zero = EvenClock(), None
        for row, t in self._times():
            zero = t[0] if zero is None else zero
            low, high = np.searchsorted(t - zero, [start, np.inf if stop is None else stop])
            if high - low > (1 if clock.empty else 0):
                clock.add(row + int(low), t[low:high])
            if not clock.even or not np.isfinite(t).all():
                return None
        found = clock.stretches()
        if sum(one.rows for one in found) <= spans.SPAN:
            return None
        if len(found) > 1:
            cut = f"{len(found) - 1} gap(s), the longest {clock.longest:.4g} s"
            said = f"{self._table.path}: {cut}, split the log into {len(found)} segments"
            warn(said, above=2)
        return found

    def _times(self) -> Iterator[tuple[int, np.ndarray]]:
        """The clock of the file in parts: first row, stamps (n,) [s]."""
        name = recorded_columns.time_column(self._table, self._data.columns)
        own = name == self._table.usual.get("time") and self._table.clock
        scale, begin = units.TIME[own or self._data.units.time], None
        for first, last in pairwise(edges(self._table.rows)):
            raw = self._table.between(first, last).load([name])[name]
            begin = recording.origin(raw, scale) if begin is None else begin
            yield first, recording.from_origin(raw, begin, scale)
