"""File -> Log: measured signals in SI units, in segments of uniform sampling.

Every unit is converted here and nowhere else, but for the clock's in `recording`. What cannot be a measurement (a NaN, time that stands still) is
refused with its row; what can be mended (an irregular clock, a gap) is mended with a notice.
"""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from . import anew, arrivals, motor_side, units, unwritten
from .clock import Clock, corrected
from .drive_spec import ActuatorSpec
from .errors import LogError
from .events import Event
from .finite import check_finite
from .full_turns import followed, going_on
from .groups import levels_of
from .held_rows import at_own_times, without_held
from .log_spec import DataSpec, LogSpec
from .recording import Recording, recorded
from .resampling import MISSING, resampled
from .rounded_stamps import ROUNDED, off_steady
from .segment import GAP_STEPS, Segment
from .slips import SLOWEST
from .spans import Spans
from .warned import warn

# Of a step: stamps that are off by less are right; and even ones, which say nothing of it, by less than the other.
_TOLD, _EVEN = 1e-3, 1e-2
NO_ACTUATORS: dict[str, ActuatorSpec] = {}
DEGREES = 4.0 * np.pi  # rad: no robot joint turns so far from zero, but its angle in degrees does


@dataclass(frozen=True)
class Log:
    """One log: where it came from, the SHA-256 of its file (of several, of all of theirs), its segments, what disturbed them, where
    it was looked for, the SHA-256 of each file by its name, the joints whose torque is not used, and at which level of which group it is."""

    name: str
    path: Path
    sha256: str
    segments: Sequence[Segment]
    events: tuple[Event, ...] = ()
    hashes: dict[str, str] = field(default_factory=dict)
    unused: tuple[str, ...] = ()
    levels: Mapping[str, str] = field(default_factory=dict)

    @property
    def stretches(self) -> int:
        """Number of stretches without a gap."""
        return self.segments.stretches if isinstance(self.segments, Spans) else len(self.segments)

    @property
    def samples(self) -> int:
        """Number of samples over all segments."""
        return self.segments.samples if isinstance(self.segments, Spans) else sum(len(segment.t) for segment in self.segments)


def read(log: LogSpec, data: DataSpec, joints: tuple[str, ...], prismatic, folder: Path = Path(), actuators=NO_ACTUATORS) -> Log:
    """Read one log of an experiment. A piece holds the samples from `start` up to, not including, `stop`: pieces that meet share none.

    Args:
        log: the file and the piece of it. data: columns, units, rate. joints: names, in order.
        prismatic: (dof,) bool. folder: what relative paths are relative to.
        actuators: {joint: what drives it} of joints whose torque was not logged.

    Raises:
        LogError: the file, a column, a unit or a value is not what a log can hold.
    """
    return assembled(measured(log, data, joints, prismatic, folder, actuators), log, data, joints, prismatic)


def assembled(samples: Recording, log: LogSpec, data: DataSpec, joints: tuple[str, ...], prismatic) -> Log:
    """The log of what was `measured` of an entry of an experiment: angles go on, an irregular clock is
    resampled, gaps and ends of recordings split it."""
    samples = arrivals.evened(going_on(samples, joints, prismatic))
    lacking, samples = unwritten.told(samples, joints), without_held(samples)
    samples = samples if data.resampling == "held" else at_own_times(samples, joints)
    hashes = {name: sha256(path) for name, path in samples.files.items()}
    each = list(hashes.values())
    whole = each[0] if len(each) == 1 else hashlib.sha256("".join(each).encode()).hexdigest()
    segments = tuple(_segments(samples.t, samples.signals, samples.where, samples.breaks, linear=data.resampling == "linear"))
    return Log(
        samples.name, next(iter(samples.files.values())), whole, segments, lacking, hashes=hashes, unused=tuple(data.unused),
        levels=levels_of(data.groups, log),
    )  # fmt: skip


def measured(
    log: LogSpec, data: DataSpec, joints: tuple[str, ...], prismatic, folder: Path = Path(), actuators=NO_ACTUATORS, *, table=None, first: int = 0
) -> Recording:  # fmt: skip
    """The samples of a log with signals in SI units, before they are resampled or split.

    Args:
        table: what to read instead of the log's files, and `first`, the number of its first row in these.

    Raises:
        LogError: as `read`.
    """
    drives = {joint: motor_side.drive(spec) for joint, spec in actuators.items()}
    samples = recorded(log, data, joints, folder, drives, table=table)
    if log.start is not None or log.stop is not None:
        first, samples = _piece(samples, log)
    if table is None:  # of what is read in parts nobody would say it of the whole
        samples = unwritten.filled(samples, joints)
    for name, values in samples.signals.items():
        check_finite(values, name, samples.where, joints=joints, t=samples.t, first=first)
    _convert(samples.signals, data, joints, prismatic, samples.where, drives)
    if table is None:
        samples = anew.apart(samples, prismatic)
    for joint, own in drives.items():
        _driven(samples, joints.index(joint), joint, own)
    return samples


def _driven(samples: Recording, j: int, joint: str, own: motor_side.Drive) -> None:
    """Put what a drive's command makes in the place of its joint's torque."""
    signals, rate = samples.signals, np.zeros(len(samples.t))
    command = signals[f"signals.{motor_side.command_name(joint)}"]
    for first, last in samples.parts:
        part = slice(first, last)
        q = signals["q"][part, j]
        q, command[part] = followed(q, command[part]) if own.servo else (q, command[part])
        signals["tau"][part, j], rate[part] = motor_side.driven(own, samples.t[part], command[part], q)
    if own.free_delay:
        signals[f"signals.{motor_side.rate_name(joint)}"] = rate


def overlapping(test: LogSpec, own: Iterable[str], train: LogSpec, other: Iterable[str]) -> bool:
    """Whether two entries of an experiment hold the same samples; own, other: the SHA-256 of their files. Pieces of recordings that
    share some of their files count from other samples: these are taken to overlap."""
    own, other = set(own), set(other)
    return not own.isdisjoint(other) and (own != other or test.overlaps(train))


def _piece(samples: Recording, log: LogSpec) -> tuple[int, Recording]:
    """The number of the piece's first sample, and its samples."""
    since = samples.t - samples.t[0]
    first, last = np.searchsorted(since, [log.start or 0.0, np.inf if log.stop is None else log.stop])
    if last - first < 2:
        raise LogError(
            f"{max(last - first, 0)} samples between start {log.start} and stop {log.stop}", where=samples.where,
            allowed=f"start < stop within 0 to {since[-1]:.6g} s, counted from the log's first sample", do="correct start and stop",
        )  # fmt: skip
    return int(first), samples.rows(int(first), int(last))


def _convert(signals, data: DataSpec, joints, prismatic, where: str, drives) -> None:
    prismatic = np.asarray(prismatic)
    unit = data.units.position
    scale = units.scales(unit, prismatic)
    if np.any(scale != 1.0):
        for name in ("q", "qd", "qdd"):
            if name in signals:
                signals[name] *= scale
        for joint, own in drives.items():
            if own.servo:
                signals[f"signals.{motor_side.command_name(joint)}"] *= scale[joints.index(joint)]
    for joint, zero in data.zero.items():
        signals["q"][:, joints.index(joint)] += zero
        if joint in drives and drives[joint].servo:
            signals[f"signals.{motor_side.command_name(joint)}"] += zero
    # a sum's factors make torque of its signals
    logged = [j for j in joints if j not in (*data.torque, *data.unused, *drives)]
    each = dict(zip(joints, units.scales(data.units.torque, prismatic)))
    if data.units.torque == "A":
        each = constants = data.units.torque_constant or {}
        if missing := [j for j in logged if j not in constants]:
            raise LogError(
                f"torque is in A and joint {missing[0]!r} has no torque constant",
                where=where,
                allowed="data.units.torque_constant: {joint: N m per A, …}",
                do="add the constants",
            )
    if any(each[j] != 1.0 for j in logged):
        signals["tau"] *= np.array([each[j] if j in logged else 1.0 for j in joints])
    if unit == "rad":
        largest = np.abs(signals["q"]).max(axis=0)
        far = [f"{joint} {value:.4g}" for joint, value, slides in zip(joints, largest, prismatic) if not slides and value > DEGREES]
        if far:
            alone = len(far) < len(joints) - prismatic.sum()  # one unit is for all of them
            do = "`sysid check` says what to write" if alone else "set data.units.position: deg"
            said = f"{where}: angles reach {', '.join(far)} rad; if that is degrees, {do}"
            warn(said, above=2)


def _segments(t, signals, where: str, breaks: Iterable[int] = (), *, linear: bool = False):
    breaks = np.array(breaks, dtype=int)
    steps = np.diff(t)
    step = float(np.median(np.delete(steps, breaks - 1)))
    cuts = np.setdiff1d(np.flatnonzero(steps > GAP_STEPS * step) + 1, breaks)
    if cuts.size:
        longest = steps[cuts - 1].max()
        warn(f"{where}: {cuts.size} gap(s), the longest {longest:.4g} s, split the log into {cuts.size + breaks.size + 1} segments", above=2)
    cuts = np.union1d(cuts, breaks).astype(int)
    uneven, off, lost = 0, 0.0, 0.0
    bounds = [0, *cuts.tolist(), len(t)]
    for a, b in zip(bounds[:-1], bounds[1:]):
        part = {name: values[a:b] for name, values in signals.items()}
        clock = t[a:b]
        if b - a < 2:
            continue
        rounding = off_steady(clock, step)
        written = rounding > ROUNDED
        true = corrected(clock, part["q"], written=written) if written or step > 0.99 * SLOWEST else Clock(clock)
        told, left = true.off > (_TOLD if written else _EVEN) * step, None
        if not told and rounding <= 2.0 * ROUNDED:
            mean = (clock[-1] - clock[0]) / (len(clock) - 1)
            yield segment(clock[0] + mean * np.arange(len(clock)), mean, part)
            continue
        own = np.diff(clock)
        # as many samples as were measured: the mean step, without the samples that are missing
        usual = own[own < MISSING * step]
        own = float(np.mean(usual if len(usual) else own))
        if told:
            clock, off = true.t, max(off, true.off)
        clock, part = resampled(clock, part, own, linear=linear)
        if told:
            rows = (left := true.at(clock, own)).inside
            lost, left = max(lost, own * rows.start, own * (len(clock) - rows.stop)), left.of(rows)
            clock, part = clock[rows], {name: values[rows] for name, values in part.items()}
        uneven += 1
        yield replace(segment(clock, own, part), clock=left)
    inside = np.delete(steps, cuts - 1)
    if uneven and inside.min() < 0.999 * inside.max():
        warn(f"{where}: steps of {inside.min():.4g} to {inside.max():.4g} s were resampled to a uniform {own:.4g} s", above=2)
    if off > 0.0:
        said = f"{where}: the time stamps are off by {1e3 * off:.2g} ms (RMS), as the joints' angles show, and were corrected"
        ends = f"; at the ends, where these do not show it, up to {lost:.2g} s is left out" if lost > 0.0 else ""
        warn(said + ends, above=2)


def segment(t, step, part) -> Segment:
    """Signals by name, those of no joint as `signals.name`, over an even clock t (n,) [s]."""
    signals = {name.removeprefix("signals."): values for name, values in part.items() if name.startswith("signals.")}
    return Segment(t, step, part["q"], part["tau"], part.get("qd"), part.get("qdd"), signals)


def sha256(path: Path) -> str:
    """The SHA-256 of a file, in hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
