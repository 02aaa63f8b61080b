"""An entry of data.train or data.test -> its columns over one clock, from however many files hold
it.

A file whose clock goes on from the one before continues it; where the clock starts anew, and at
every new episode of a data set, a recording of its own begins: `breaks`, which nothing is filtered
across.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from . import datasets, motor_side, stamps, units
from .errors import LogError
from .log_spec import DataSpec, LogSpec
from .readers import open_table
from .readers.table import Table
from .recorded_columns import KEYS, check_headers, meant, names_of, refuse_shared, single, time_of
from .warned import warn

_EPOCH = 1e6  # s: a clock that reads more counts from 1970, not from the log's start
EPISODE = "episode_index"  # the column in which LeRobot numbers episodes


@dataclass(frozen=True)
class Recording:
    """Samples as they were logged. t (n,) [s], increasing; signals {name: (n, ...)}; breaks: rows
    at which another recording begins; name, and where to find it in a message; files: path of each
    file, by its name; empty: (joint, first, last) of rows in which a joint's torque was not
    written, and is a straight line; together: rows with the stamp of the one before and other
    values, which stand a little behind it."""

    name: str
    where: str
    files: dict[str, Path]
    t: np.ndarray
    signals: dict[str, np.ndarray]
    breaks: np.ndarray
    empty: tuple[tuple[int, int, int], ...] = ()
    together: tuple[int, ...] = ()

    def rows(self, first: int, last: int) -> Recording:
        """The samples from row `first` up to, not including, `last`."""
        part = slice(first, last)
        inside = self.breaks[(self.breaks > first) & (self.breaks < last)] - first
        signals = {name: values[part] for name, values in self.signals.items()}
        own = tuple(row - first for row in self.together if first < row < last)
        t = self.t[part]
        return replace(self, t=t, signals=signals, breaks=inside, together=own)

    @property
    def parts(self) -> list[tuple[int, int]]:
        """First row and the row after the last of what was recorded in one go."""
        bounds = [0, *self.breaks.tolist(), len(self.t)]
        return list(zip(bounds[:-1], bounds[1:]))


def recorded(
    log: LogSpec, data: DataSpec, joints: tuple[str, ...], folder: Path, drives: dict, *, table=None
) -> Recording:
    """What an entry of an experiment holds, in the units of its files but for time.

    Args:
        joints: names, in order. folder: what relative paths are relative to. drives: {joint: what
            drives it} where torque was not logged; `signals.command.joint` is then its command.
        table: what to read instead of the entry's files.

    Raises:
        LogError: a file or a column is not there, or what it holds is no log.
    """
    if table is not None:
        tables = {log.names[0]: table}
    else:
        tables = {name: table_of(name, log, folder) for name in log.names}
    where = " + ".join(str(table.path) for table in tables.values())
    loaded = [_load(table, data, joints, log.episodes, drives) for table in tables.values()]
    if len({unit for _, unit, _, _ in loaded}) > 1:
        raise LogError(
            "the clocks of these files have different units", where=where,
            allowed="files of one logger", do="give them as logs of their own",
        )  # fmt: skip
    borders = np.cumsum([len(signals["q"]) for *_, signals, _ in loaded])
    signals = {name: _joined([part[name] for *_, part, _ in loaded]) for name in loaded[0][2]}
    breaks = np.concatenate([rows + start for start, (*_, rows) in zip([0, *borders], loaded)])
    if data.rate:
        t = np.arange(borders[-1]) / data.rate
        breaks = np.union1d(breaks, borders[:-1])
    else:
        t = _seconds(_joined([t for t, *_ in loaded]), loaded[0][1])
        anew = [row for row in borders[:-1] if t[row] <= t[row - 1]]
        if anew:
            warn(
                f"{where}: the clock starts anew in {len(anew)} of {len(tables)} files; "
                "what each holds is a segment of its own",
                above=2,
            )
        breaks = np.union1d(breaks, anew)
        own = stamps.starts(t, breaks)
        if len(own):
            warn(
                f"{where}: the clock starts anew at row {', '.join(map(str, own[:4]))}"
                f"{', ...' * (len(own) > 4)} counted from 0: what comes from there on is a recording "
                "of its own, whose times are taken to go on",
                above=2,
            )
        breaks = np.union1d(breaks, own)
    files = {
        name if path == table.path else f"{name}/{path.relative_to(table.path).as_posix()}": path
        for name, table in tables.items()
        for path in table.files
    }
    breaks = breaks.astype(int)
    t, together = stamps.in_packets(t, signals, breaks)
    t = stamps.increasing(t, breaks, where)
    return Recording(log.name, where, files, t, signals, breaks, together=together)


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def table_of(name: str, log: LogSpec, folder: Path) -> Table:
    """The table that a name of an entry stands for. Raises LogError."""
    if (dataset := datasets.reference(name)) is not None:
        return dataset.open(dataset.locate())
    return open_table((folder / name).resolve(), log.topic)


def _load(table: Table, data: DataSpec, joints, episodes, drives):
    """Stamps (None where a rate is given), their unit, the signals (n, dof) by name, others as
    `signals.name`, and the rows at which an episode begins."""
    spec, wanted = data.columns, {}
    needed = {
        "q": motor_side.has_column(data.position, (), joints),
        "tau": motor_side.has_column(data.torque, (*data.unused, *drives), joints),
    }
    for name, key in KEYS.items():
        if (pattern := meant(table, spec, key)) is not None:
            own = needed.get(name, [True] * len(joints))
            there = names_of(table, pattern, joints, name, own) if any(own) else [None] * len(own)
            wanted[name] = there
    refuse_shared(table, wanted, joints)
    wanted |= _signals(table, data, joints, drives)
    time = None if data.rate else time_of(table, meant(table, spec, "time"))
    counted = EPISODE if table.has(EPISODE) else None
    if episodes is not None and counted is None:
        raise LogError(
            f"an episode is asked for, and there is no column {EPISODE!r}", where=str(table.path),
            do="remove episode, or give start and stop",
        )  # fmt: skip
    asked = [*filter(None, (time, counted)), *(c for names in wanted.values() for c in names if c)]
    columns = table.load(list(dict.fromkeys(asked)), _may_lack(wanted, data))
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        shown = ", ".join(f"{name!r} {length}" for name, length in lengths.items())
        raise LogError(
            f"columns differ in length: {shown}",
            where=str(table.path),
            allowed="a value in every column for each sample",
            do="correct data.columns or the log",
        )
    if not min(lengths.values()):
        raise LogError(
            "the log has no samples", where=str(table.path), do="give a log with samples"
        )
    rows, breaks = slice(None), np.zeros(0, dtype=int)
    if counted:
        rows, breaks = _chosen(columns[counted], episodes, str(table.path))
    unit = (
        table.clock if time and time == table.usual.get("time") and table.clock else data.units.time
    )
    check_headers(table, data, wanted, time)
    signals = {}
    for name, names in wanted.items():
        if len(names) == 1 and names[0]:
            values = np.array(columns[names[0]][rows], dtype=float)
            alone = values.ndim == 2 or name not in ("q", "tau", "qd", "qdd")
            signals[name] = values if alone else values[:, None]
        else:
            samples = len(np.arange(min(lengths.values()))[rows])
            signals[name] = np.zeros((samples, len(names)))
            for k, c in enumerate(names):
                if c:
                    signals[name][:, k] = columns[c][rows]
    _sum(signals, data, joints)
    return (columns[time][rows] if time else None), unit, signals, breaks


def _may_lack(wanted: dict, data: DataSpec) -> set[str]:
    """The columns that may be empty in some rows: those of torque, and what alone torque's sums need."""
    sums = [f"sums.{name}" for entry in data.torque.values() for name in entry]
    return {column for key in ("tau", *sums) for column in wanted.get(key, ()) if column}


def _signals(table: Table, data: DataSpec, joints, drives) -> dict[str, list[str]]:
    """The columns of other signals, as `signals.name`; of what only sums need, as `sums.name`."""
    named = {**data.columns.signals, **data.signals}
    wanted = {f"signals.{n}": [single(table, c, f"signal {n!r}")] for n, c in named.items()}
    free = [n for entry in data.torque.values() for n in entry if n not in motor_side.told(entry)]
    for sums in (data.position, data.torque):
        for name in motor_side.signals_of(sums, joints):
            if name not in named:  # effects see it only where a factor of it is free
                kind = "signals" if name in free else "sums"
                wanted[f"{kind}.{name}"] = [single(table, name, f"signal {name!r}")]
    for joint, drive in drives.items():
        column = named.get(drive.column, drive.column)
        name = f"signals.{motor_side.command_name(joint)}"
        wanted[name] = [single(table, column, f"actuator.{joint}")]
    return wanted


def _sum(signals: dict, data: DataSpec, joints) -> None:
    """Put sums in the place of what they stand for, and nothing in that of torque not used."""
    torques = {joint: motor_side.told(entry) for joint, entry in data.torque.items()}
    alone = lambda name: signals.get(f"signals.{name}", signals.get(f"sums.{name}"))  # noqa: E731
    for key, sums, where in (("q", data.position, "position"), ("tau", torques, "torque")):
        signals[key] = motor_side.summed(sums, joints, signals[key], alone, f"data.{where}")
    signals["tau"][:, [joints.index(joint) for joint in data.unused]] = 0.0
    for name in [name for name in signals if name.startswith("sums.")]:
        del signals[name]


def _chosen(index, episodes, where: str):
    """The rows of the episodes, in the file's order, and where among them an episode begins."""
    rows = np.arange(len(index))
    if episodes is not None:
        if missing := sorted(episodes - set(np.unique(index).tolist())):
            there = np.unique(index)
            raise LogError(
                f"there is no episode {missing[0]}",
                where=where,
                allowed=f"{there[0]:g} to {there[-1]:g}"
                if len(there) > 8
                else ", ".join(f"{k:g}" for k in there),
                do="correct episode",
            )
        rows = np.flatnonzero(np.isin(index, sorted(episodes)))
    return rows, np.flatnonzero(np.diff(index[rows])) + 1


def _seconds(t, unit: str) -> np.ndarray:
    scale = units.TIME[unit]
    return from_origin(t, origin(t, scale), scale)


def origin(t, scale: float):
    """What the stamps of a clock [1 / scale s] are counted from: their own begin where they count
    from 1970."""
    # large stamps (ns since 1970) lose nothing if the start is taken off before the unit is
    # converted
    return _whole(t)[0] if _EPOCH <= abs(t[0] * scale) < np.inf else 0


def from_origin(t, start, scale: float) -> np.ndarray:
    """Stamps in seconds."""
    return (_whole(t) - start) * scale


def _whole(t) -> np.ndarray:
    return t.astype(np.int64, copy=False) if t.dtype.kind in "iu" else t
