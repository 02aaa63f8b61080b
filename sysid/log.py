"""File -> Log: measured signals in SI units, in segments of uniform sampling.

Every unit is converted here and nowhere else. What cannot be a measurement (a NaN, time that stands still) is
refused with its row; what can be mended (an irregular clock, a gap) is mended with a notice.
"""

import hashlib
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from . import datasets, units
from .clock import corrected
from .errors import LogError, SysidWarning
from .events import Event
from .readers import open_table
from .readers.table import Table
from .segment import Segment
from .specs import DataSpec, LogSpec

# A step longer than this many median steps is a hole that interpolation would invent motion for.
GAP_STEPS = 10.0
# Steps that all stay this close to the median are uniform sampling with rounded time stamps.
_UNIFORM = 0.02
# Of a step: stamps that are off by less are right.
_TOLD = 1e-3
_EPOCH = 1e6  # s: a clock that reads more counts from 1970, not from the log's start
_LARGEST = 1e20  # no unit makes a measured signal larger (a clock in ns, logged as a signal, reads 2e18)
DEGREES = 4.0 * np.pi  # rad: no robot joint turns so far from zero, but its angle in degrees does


@dataclass(frozen=True)
class Log:
    """One log: where it came from, the SHA-256 of its file, its segments, and what disturbed them, where it was looked for."""

    name: str
    path: Path
    sha256: str
    segments: tuple[Segment, ...]
    events: tuple[Event, ...] = ()

    @property
    def samples(self) -> int:
        """Number of samples over all segments."""
        return sum(len(segment.t) for segment in self.segments)


def read(log: LogSpec, data: DataSpec, joints: tuple[str, ...], prismatic, folder: Path = Path()) -> Log:
    """Read one log of an experiment. A piece holds the samples from `start` up to, not including, `stop`: pieces that meet share none.

    Args:
        log: the file and the piece of it. data: columns, units, rate. joints: names, in order.
        prismatic: (dof,) bool. folder: what relative paths are relative to.

    Raises:
        LogError: the file, a column, a unit or a value is not what a log can hold.
    """
    return assembled(log.file, *measured(log, data, joints, prismatic, folder))


def assembled(name: str, path: Path, t, signals: dict) -> Log:
    """The log of what was `measured`: resampled where its clock is irregular, split at gaps."""
    return Log(name=name, path=path, sha256=_sha256(path), segments=tuple(_segments(t, signals, str(path))))


def measured(log: LogSpec, data: DataSpec, joints: tuple[str, ...], prismatic, folder: Path = Path()) -> tuple[Path, np.ndarray, dict]:
    """The file of a log, its stamps t (n,) [s] and its signals {name: (n, ...)} in SI units, before they are resampled or split.

    Raises:
        LogError: as `read`.
    """
    if (dataset := datasets.reference(log.file)) is not None:
        path = dataset.locate()
        table = dataset.open(path)
    else:
        path = (folder / log.file).resolve()
        table = open_table(path)
    t, signals = _load(table, data, joints)
    where = str(path)
    t = _clock(t, data, where, len(signals["q"]))
    _check_time(t, where)
    first = 0
    if log.start is not None or log.stop is not None:
        first, t, signals = _piece(t, signals, log, where)
    for name, values in signals.items():
        _check_finite(values, name, t, joints, where, first)
    _convert(signals, data, joints, prismatic, where)
    return path, t, signals


def _load(table: Table, data: DataSpec, joints):
    """The time column and the (n, dof) signals by name; other signals under their own names, as `signals.name`."""
    spec = data.columns
    wanted: dict[str, list[str]] = {}
    for name, pattern in (("q", spec.position), ("tau", spec.torque), ("qd", spec.velocity), ("qdd", spec.acceleration)):
        if pattern is not None:
            wanted[name] = _names(table, pattern, joints, name)
    for name, column in {**spec.signals, **data.signals}.items():
        wanted[f"signals.{name}"] = [_single(table, column, f"signal {name!r}")]
    time = [] if data.rate else [_single(table, spec.time, "time")]
    columns = table.load(list(dict.fromkeys(time + [c for names in wanted.values() for c in names])))
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
        raise LogError("the log has no samples", where=str(table.path), do="give a log with samples")
    signals = {}
    for name, names in wanted.items():
        if len(names) == 1:
            values = np.array(columns[names[0]], dtype=float)
            signals[name] = values if values.ndim == 2 or name.startswith("signals.") else values[:, None]
        else:
            signals[name] = np.empty((lengths[names[0]], len(names)))
            for k, c in enumerate(names):
                signals[name][:, k] = columns[c]
    return (columns[time[0]] if time else None), signals


def _names(table: Table, pattern, joints, signal: str) -> list[str]:
    if isinstance(pattern, str) and "{joint}" not in pattern:
        name = table.resolve(pattern)
        if table.width(name) != len(joints):
            raise LogError(
                f"{signal}: column {name!r} is {table.width(name)} wide for {len(joints)} joints", where=str(table.path),
                allowed="a pattern with {joint}, a list with a column for each joint, or a matrix that wide", do="correct data.columns",
            )  # fmt: skip
        return [name]
    if isinstance(pattern, str):
        pattern = [pattern.replace("{joint}", joint) for joint in joints]
        for joint, name in zip(joints, pattern):
            if name not in table.names:
                raise LogError(
                    f"joint {joint!r} has no column: {name!r} is not there", where=str(table.path),
                    allowed=table.some_names(),
                    do="correct data.columns or robot.joints",
                )  # fmt: skip
    if len(pattern) != len(joints):
        raise LogError(
            f"{signal}: {len(pattern)} columns for {len(joints)} joints",
            where=str(table.path),
            allowed=f"one for each of {', '.join(joints)}",
            do="correct data.columns",
        )
    return [_single(table, column, signal) for column in pattern]


def _single(table: Table, column, signal: str) -> str:
    name = table.resolve(column)
    if (width := table.width(name)) > 1:
        raise LogError(
            f"{signal}: {name!r} is {width} columns",
            where=str(table.path),
            allowed=f"one of {name}[0] to {name}[{width - 1}]",
            do="correct data.columns",
        )
    return name


def _clock(t, data: DataSpec, where: str, samples: int) -> np.ndarray:
    if t is None:
        return np.arange(samples) / data.rate
    scale = units.TIME[data.units.time]
    # large stamps (ns since 1970) lose nothing if the start is taken off before the unit is converted
    t = t.astype(np.int64, copy=False) if t.dtype.kind in "iu" else t
    start = t[0] if _EPOCH <= abs(t[0] * scale) < np.inf else 0
    return (t - start) * scale


def _piece(t, signals, log: LogSpec, where: str):
    """The number of the piece's first sample, and its time and signals."""
    since = t - t[0]
    first, last = np.searchsorted(since, [log.start or 0.0, np.inf if log.stop is None else log.stop])
    if last - first < 2:
        raise LogError(
            f"{max(last - first, 0)} samples between start {log.start} and stop {log.stop}", where=where,
            allowed=f"start < stop within 0 to {since[-1]:.6g} s, counted from the log's first sample", do="correct start and stop",
        )  # fmt: skip
    part = slice(int(first), int(last))
    return part.start, t[part], {name: values[part] for name, values in signals.items()}


def _check_time(t, where: str) -> None:
    if not np.isfinite(t).all():
        raise LogError("time is not a finite number", where=f"{where} row {int(np.argmin(np.isfinite(t)))} counted from 0", do="leave the row out")
    if len(t) < 2:
        raise LogError("the log has one sample", where=where, allowed="two or more", do="give a longer log")
    backwards = np.diff(t) <= 0.0
    if backwards.any():
        row = int(np.argmax(backwards)) + 1
        verb = "stands still" if t[row] == t[row - 1] else "runs backwards"
        raise LogError(
            f"time {verb}: {t[row - 1]:.9g} s, then {t[row]:.9g} s",
            where=f"{where} row {row} counted from 0",
            allowed="increasing time",
            do="sort the rows or leave doubles out",
        )


def _check_finite(values, name: str, t, joints, where: str, first: int) -> None:
    # only a bad log pays for the search; a NaN fails both comparisons
    if values.max() <= _LARGEST and values.min() >= -_LARGEST:
        return
    row, *column = (int(k) for k in np.argwhere(~(np.abs(values) <= _LARGEST))[0])
    joint = f" of joint {joints[column[0]]!r}" if column else ""
    raise LogError(
        f"{name.removeprefix('signals.')}{joint} is {values[row, *column]:g}", where=f"{where} row {first + row} counted from 0, t = {t[row]:.6g} s",
        allowed=f"finite numbers, at most {_LARGEST:g} in size", do="leave the row out; a gap is split there",
    )  # fmt: skip


def _convert(signals, data: DataSpec, joints, prismatic, where: str) -> None:
    prismatic = np.asarray(prismatic)
    unit = data.units.position
    angular = unit in ("rad", "deg")
    # one unit is named for all joints: an angle for the turning ones, a length for the sliding ones
    scale = np.where(prismatic, 1.0 if angular else units.POSITION[unit], units.POSITION[unit] if angular else 1.0)
    if np.any(scale != 1.0):
        for name in ("q", "qd", "qdd"):
            if name in signals:
                signals[name] *= scale
    if data.units.torque == "A":
        constants = data.units.torque_constant
        if constants is None or (missing := [j for j in joints if j not in constants]):
            missing = list(joints) if constants is None else missing
            raise LogError(
                f"torque is in A and joint {missing[0]!r} has no torque constant",
                where=where,
                allowed="data.units.torque_constant: {joint: N m per A, …}",
                do="add the constants",
            )
        signals["tau"] *= np.array([constants[j] for j in joints])
    if unit == "rad":
        largest = np.abs(signals["q"]).max(axis=0)
        for joint, value, slides in zip(joints, largest, prismatic):
            if not slides and value > DEGREES:
                warnings.warn(
                    SysidWarning(f"{where}: joint {joint!r} reaches {value:.4g} rad; if that is degrees, set data.units.position: deg"), stacklevel=3
                )


def _segments(t, signals, where: str):
    steps = np.diff(t)
    step = float(np.median(steps))
    cuts = np.flatnonzero(steps > GAP_STEPS * step) + 1
    if cuts.size:
        longest = steps[cuts - 1].max()
        warnings.warn(
            SysidWarning(f"{where}: {cuts.size} gap(s), the longest {longest:.4g} s, split the log into {cuts.size + 1} segments"), stacklevel=3
        )
    resampled, off = 0, 0.0
    bounds = [0, *cuts.tolist(), len(t)]
    for a, b in zip(bounds[:-1], bounds[1:]):
        part = {name: values[a:b] for name, values in signals.items()}
        clock = t[a:b]
        if b - a < 2:
            continue
        if _is_uniform(clock, step):
            mean = (clock[-1] - clock[0]) / (len(clock) - 1)
            yield _segment(clock[0] + mean * np.arange(len(clock)), mean, part)
            continue
        own = np.diff(clock)
        # as many samples as were measured: the mean step, without the samples that are missing
        own = float(np.mean(own[own < 1.5 * step]))
        true, left = corrected(clock, part["q"]), None
        told = true.off > _TOLD * step
        if told:
            clock, off = true.t, max(off, true.off)
        clock, part = _resampled(clock, part, own)
        if told:
            left = true.at(clock, own)
        resampled += 1
        yield replace(_segment(clock, own, part), clock=left)
    if resampled:
        warnings.warn(
            SysidWarning(f"{where}: steps of {steps.min():.4g} to {np.delete(steps, cuts - 1).max():.4g} s were resampled to a uniform {own:.4g} s"),
            stacklevel=3,
        )
    if off > 0.0:
        warnings.warn(
            SysidWarning(
                f"{where}: the time stamps are off by {1e3 * off:.2g} ms (RMS), as the joints' angles show, and were corrected"
            ),
            stacklevel=3,
        )


def _is_uniform(t, step: float) -> bool:
    """A steady clock: every step close to the median one, or every stamp a steady one that was rounded."""
    if np.abs(np.diff(t) - step).max() <= _UNIFORM * step:
        return True
    steady = np.linspace(t[0], t[-1], len(t))
    since = t - t[0]
    for digits in range(10):
        quantum = 10.0**-digits
        if quantum <= step and np.abs(since / quantum - np.round(since / quantum)).max() < 1e-3:
            # the two end stamps are rounded as well, each by up to half a quantum
            return bool(np.abs(t - steady).max() <= 1.01 * quantum)
    return False


def _segment(t, step, part) -> Segment:
    signals = {name.removeprefix("signals."): values for name, values in part.items() if name.startswith("signals.")}
    return Segment(t, step, part["q"], part["tau"], part.get("qd"), part.get("qdd"), signals)


def _resampled(t, part, step):
    from scipy.interpolate import make_interp_spline

    samples = int(np.floor((t[-1] - t[0]) / step + 1e-9)) + 1
    clock = t[0] + step * np.arange(samples)
    out = {}
    for name, values in part.items():
        # angles are smooth, torque and the rest carry noise that a cubic would overshoot on
        order = 3 if name in ("q", "qd") and len(t) > 3 else 1
        out[name] = make_interp_spline(t, values, k=order, axis=0)(clock)
    return clock, out


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
