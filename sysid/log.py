"""File -> Log: measured signals in SI units, in segments of uniform sampling.

Every unit is converted here and nowhere else. What cannot be a measurement (a NaN, time that stands still) is
refused with its row; what can be mended (an irregular clock, a gap) is mended with a notice.
"""

import hashlib
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import datasets, units
from .config import DataSpec, LogSpec
from .errors import LogError, SysidWarning
from .readers import open_table
from .readers.table import Table

# A step longer than this many median steps is a hole that interpolation would invent motion for.
_GAP_STEPS = 10.0
# Steps that all stay this close to the median are uniform sampling with rounded time stamps.
_UNIFORM = 0.02
_DEGREES = 4.0 * np.pi  # rad: no robot joint turns so far from zero, but its angle in degrees does


@dataclass(frozen=True)
class Segment:
    """Uniformly sampled signals without a gap. t (n,) [s]; q, tau (n, dof); qd, qdd (n, dof) or None where not logged."""

    t: np.ndarray
    step: float
    q: np.ndarray
    tau: np.ndarray
    qd: np.ndarray | None
    qdd: np.ndarray | None
    signals: dict[str, np.ndarray]


@dataclass(frozen=True)
class Log:
    """One log: where it came from, the SHA-256 of its file, its segments."""

    name: str
    path: Path
    sha256: str
    segments: tuple[Segment, ...]

    @property
    def samples(self) -> int:
        """Number of samples over all segments."""
        return sum(len(segment.t) for segment in self.segments)


def read(log: LogSpec, data: DataSpec, joints: tuple[str, ...], prismatic, folder: Path = Path()) -> Log:
    """Read one log of an experiment.

    Args:
        log: the file and the piece of it. data: columns, units, rate. joints: names, in order.
        prismatic: (dof,) bool. folder: what relative paths are relative to.

    Raises:
        LogError: the file, a column, a unit or a value is not what a log can hold.
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
    if log.start is not None or log.stop is not None:
        t, signals = _piece(t, signals, log, where)
    _check_time(t, where)
    for name, values in signals.items():
        _check_finite(values, name, t, joints, where)
    _convert(signals, data, joints, prismatic, where)
    segments = tuple(_segments(t, signals, where))
    return Log(name=log.file, path=path, sha256=_sha256(path), segments=segments)


def _load(table: Table, data: DataSpec, joints):
    """The time column and the (n, dof) signals by name; other signals under their own names, as `signals.name`."""
    spec = data.columns
    wanted: dict[str, list[str]] = {}
    for name, pattern in (("q", spec.position), ("tau", spec.torque), ("qd", spec.velocity), ("qdd", spec.acceleration)):
        if pattern is not None:
            wanted[name] = _names(table, pattern, joints, name)
    others = {**spec.signals, **data.signals}
    for name, column in others.items():
        wanted[f"signals.{name}"] = [table.resolve(column)]
    time = [] if data.rate else [table.resolve(spec.time)]
    columns = table.load(list(dict.fromkeys(time + [c for names in wanted.values() for c in names])))
    signals = {}
    for name, names in wanted.items():
        if len(names) == 1 and columns[names[0]].ndim == 2:
            signals[name] = np.array(columns[names[0]])
        else:
            if lengths := sorted({len(columns[c]) for c in names}):
                if len(lengths) > 1:
                    raise LogError(f"columns of {name} have {lengths[0]} and {lengths[-1]} samples", where=str(table.path))
            out = np.empty((len(columns[names[0]]), len(names)))
            for k, c in enumerate(names):
                out[:, k] = columns[c]
            signals[name] = out if not name.startswith("signals.") else out[:, 0]
    lengths = {name: len(values) for name, values in signals.items()}
    if len(set(lengths.values())) > 1:
        raise LogError(f"signals differ in length: {lengths}", where=str(table.path))
    if not lengths["q"]:
        raise LogError("the log has no samples", where=str(table.path))
    return (columns[time[0]] if time else None), signals


def _names(table: Table, pattern, joints, signal: str) -> list[str]:
    if isinstance(pattern, str) and "{joint}" not in pattern:
        name = table.resolve(pattern)
        if table.width(name) != len(joints):
            raise LogError(
                f"{signal}: column {name!r} is {table.width(name)} wide for {len(joints)} joints", where=str(table.path),
                allowed='a pattern with {joint}, a list with a column for each joint, or a matrix that wide',
            )  # fmt: skip
        return [name]
    if isinstance(pattern, str):
        pattern = [pattern.replace("{joint}", joint) for joint in joints]
        for joint, name in zip(joints, pattern):
            if name not in table.names:
                raise LogError(
                    f"joint {joint!r} has no column: {name!r} is not there", where=str(table.path),
                    allowed=", ".join(table.names[:20]) + (" …" if len(table.names) > 20 else ""),
                    do="correct data.columns or robot.joints",
                )  # fmt: skip
    if len(pattern) != len(joints):
        raise LogError(f"{signal}: {len(pattern)} columns for {len(joints)} joints", where=str(table.path), allowed=f"one for each of {', '.join(joints)}", do="correct data.columns")
    return [table.resolve(column) for column in pattern]


def _clock(t, data: DataSpec, where: str, samples: int) -> np.ndarray:
    if t is None:
        return np.arange(samples) / data.rate
    if t.ndim != 1 or len(t) != samples:
        raise LogError(f"time has {t.shape} values for {samples} samples", where=where)
    scale = units.TIME[data.units.time]
    # large stamps (ns since 1970) lose nothing if the start is taken off before the unit is converted
    start = t[0] if np.isfinite(t[0]) else 0.0
    return (t - start) * scale + (start * scale if abs(start * scale) < 1e6 else 0.0)


def _piece(t, signals, log: LogSpec, where: str):
    since = t - t[0]
    keep = (since >= (log.start if log.start is not None else -np.inf)) & (since <= (log.stop if log.stop is not None else np.inf))
    if not keep.any():
        raise LogError(f"no sample between start {log.start} and stop {log.stop}", where=where, allowed=f"0 to {since[-1]:.6g} s from the log's first sample")
    part = slice(int(np.argmax(keep)), len(keep) - int(np.argmax(keep[::-1])))
    return t[part], {name: values[part] for name, values in signals.items()}


def _check_time(t, where: str) -> None:
    if not np.isfinite(t).all():
        raise LogError("time is not a finite number", where=f"{where} row {int(np.argmin(np.isfinite(t)))}", do="leave the row out")
    if len(t) < 2:
        raise LogError("fewer than two samples", where=where)
    backwards = np.diff(t) <= 0.0
    if backwards.any():
        row = int(np.argmax(backwards)) + 1
        verb = "stands still" if t[row] == t[row - 1] else "runs backwards"
        raise LogError(f"time {verb}: {t[row - 1]:.9g} s, then {t[row]:.9g} s", where=f"{where} row {row}", allowed="increasing time", do="sort the rows or leave doubles out")


def _check_finite(values, name: str, t, joints, where: str) -> None:
    # a sum is finite when all its terms are; only a bad log pays for the search
    if np.isfinite(values.sum()) or np.isfinite(values).all():
        return
    row, *column = (int(k) for k in np.argwhere(~np.isfinite(values))[0])
    joint = f" of joint {joints[column[0]]!r}" if column else ""
    value = values[row, column[0]] if column else values[row]
    raise LogError(f"{name.removeprefix('signals.')}{joint} is {value}", where=f"{where} row {row} (t = {t[row]:.6g} s)", allowed="finite numbers", do="leave the row out; a gap is split there")


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
            raise LogError(f"torque is in A and joint {missing[0]!r} has no torque constant", where=where, allowed="data.units.torque_constant: {joint: N m per A, …}", do="add the constants")
        signals["tau"] *= np.array([constants[j] for j in joints])
    if unit == "rad":
        largest = np.abs(signals["q"]).max(axis=0)
        for joint, value, slides in zip(joints, largest, prismatic):
            if not slides and value > _DEGREES:
                warnings.warn(SysidWarning(f"{where}: joint {joint!r} reaches {value:.4g} rad; if that is degrees, set data.units.position: deg"), stacklevel=3)


def _segments(t, signals, where: str):
    steps = np.diff(t)
    step = float(np.median(steps))
    cuts = np.flatnonzero(steps > _GAP_STEPS * step) + 1
    if cuts.size:
        longest = steps[cuts - 1].max()
        warnings.warn(SysidWarning(f"{where}: {cuts.size} gap(s), the longest {longest:.4g} s, split the log into {cuts.size + 1} segments"), stacklevel=3)
    resampled = 0
    bounds = [0, *cuts.tolist(), len(t)]
    for a, b in zip(bounds[:-1], bounds[1:]):
        part = {name: values[a:b] for name, values in signals.items()}
        clock = t[a:b]
        if b - a < 2:
            continue
        if np.abs(np.diff(clock) - step).max() > _UNIFORM * step:
            clock, part = _resampled(clock, part, step)
            resampled += 1
        else:
            step_here = (clock[-1] - clock[0]) / (len(clock) - 1)
            yield _segment(clock, step_here, part)
            continue
        yield _segment(clock, step, part)
    if resampled:
        warnings.warn(SysidWarning(f"{where}: steps of {steps.min():.4g} to {np.delete(steps, cuts - 1).max():.4g} s were resampled to a uniform {step:.4g} s"), stacklevel=3)


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


