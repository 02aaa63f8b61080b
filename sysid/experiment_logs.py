"""An experiment's logs as they were measured: read, with their events, and without what it masks."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from . import events, long_log, masks, robot, unwritten
from . import log as logs
from .bumps import bumps
from .free_memory import released
from .glitches import without_glitches, without_their_slopes
from .log_spec import LogSpec
from .model import Model
from .robot import Robot
from .slips import without_slips
from .spans import Spans
from .specs import Experiment
from .warned import noticed
from .workers import Mapped


def read(experiment: Experiment, machine: Robot, specs: list[LogSpec], *, structure: Model | None = None, mapped: Mapped | None = None) -> list[logs.Log]:
    """The logs of an experiment's `data.train` or `data.test`, with their events where these are left out, and what the experiment
    masks.

    Args:
        structure: the model that they are read for: where nothing of it looks at a log as a whole, long logs are spans, which are read
            when they are asked for. None: they are read whole.
        mapped: what shares long logs among processes, as of `workers.crew`; None: there is this one.

    Raises:
        LogError: as `log.read`. ConfigError: a mask that cannot be.
    """
    reader = long_log if structure is not None and structure.local else logs
    how = (experiment.data, machine.joints, machine.prismatic, experiment.folder, experiment.actuator)
    if mapped and reader is long_log and any(long_log.in_parts(spec, *how) for spec in specs):
        # where one log is long, each is looked at by itself
        found = list(mapped(_read_one, ((machine, experiment.preprocess.events, spec, how) for spec in specs)))
    else:
        read = [reader.read(spec, *how) for spec in specs]
        found = read if experiment.preprocess.events == "keep" else with_events(machine, read, driven=experiment.actuator)
    return masks.masked(found, experiment.preprocess.mask, machine.joints)


def _read_one(machine: Robot, kept: str, spec: LogSpec, how: tuple) -> logs.Log:
    log = long_log.read(spec, *how)
    return log if kept == "keep" else with_events(machine, [log], driven=how[-1])[0]


_BESIDE = 1024  # rows of a span's neighbours that are looked at with it: more than an event's surroundings


def with_events(machine: Robot, read: list[logs.Log], *, driven: Collection[str] = ()) -> list[logs.Log]:
    """Logs with their events: first those that the signals show, then those that only the robot's equations do. Each span of a long
    log is looked at by itself.

    Args:
        driven: joints whose torque is that of an actuator, which may be the same throughout.
    """
    short = [log for log in read if not isinstance(log.segments, Spans)]
    silent = _silent(short, [np.stack([unwritten.extent(s) for s in log.segments]) for log in short], machine, driven)
    done = iter(_disturbed(machine, [replace(log, events=own) for log, own in zip(short, silent)]) if short else ())
    return [_disturbed_in_spans(machine, log, driven) if isinstance(log.segments, Spans) else next(done) for log in read]


def _silent(read: list[logs.Log], extents: list[np.ndarray], machine: Robot, driven: Collection[str]) -> list[tuple[events.Event, ...]]:
    """What of the logs' torques was not logged, by the extents of their segments."""
    ends = [(log.name, float(log.segments[0].t[0]), float(log.segments[-1].t[-1])) for log in read]
    found = unwritten.unlogged([(*own, extent) for own, extent in zip(ends, extents)], machine.joints)
    return [tuple(e for e in (*log.events, *own) if not {*e.joints} & {*driven, *log.unused}) for log, own in zip(read, found)]


def _disturbed(machine: Robot, read: list[logs.Log], *, among: int = 1) -> list[logs.Log]:
    """Logs with what disturbed them beside the events that they have.

    Args:
        among: how many parts their log has, where these are the spans of one.
    """
    found = [_shown(machine, log, among) for log in read]
    if among > 1:  # what is looked for in signals leaves half a span's memory free between what is held
        released()
    felt = bumps(machine, found, among=among)
    other = [[e for e in log.events if e.kind != "knock"] for log in found]
    knocks = [[e for e in felt if e.log == log.name] for log in found]
    return [replace(log, events=events.ordered([*own, *more])) for log, own, more in zip(found, other, knocks)]


def _shown(machine: Robot, log: logs.Log, among: int) -> logs.Log:
    """A log with what its signals show of disturbances, and without its angles' glitches and slips."""
    found, segments = list(log.events), []
    for segment in log.segments:
        angles, alone, steps = segment.q, [], []
        if among == 1:  # a span of a long log is read anew, as it is
            angles, alone = without_glitches(segment.q)
        if among == 1 and segment.clock is None:  # stamps that were wrong have been corrected
            angles, steps = without_slips(angles, segment.step)
        own = events.find(segment, machine.joints, log=log.name, among=among, angles=angles)
        for kind, places in (("glitch", alone), ("slip", steps)):
            own = [*own, *_of_angles(kind, segment.t, places, machine.joints, log.name)]
        found += [e for e in own if not (e.signal == "torque" and set(e.joints) <= set(log.unused))]
        rates = {name: without_their_slopes(getattr(segment, name), alone) for name in ("qd", "qdd")}
        segments.append(segment if angles is segment.q else replace(segment, q=angles, **rates))
    return replace(log, events=tuple(found), segments=tuple(segments))


def _of_angles(kind: str, t, found: list[list[tuple[int, int]]], joints: tuple[str, ...], log: str) -> list[events.Event]:
    """One event of all joints whose angles step, or stand alone, at the same sample."""
    members: dict[tuple[int, int], list[str]] = {}
    for joint, places in zip(joints, found):
        for place in places:
            members.setdefault(place, []).append(joint)
    return [events.Event(kind, log, float(t[a]), float(t[b]), tuple(own), "position") for (a, b), own in members.items()]


def _disturbed_in_spans(machine: Robot, log: logs.Log, driven: Collection[str]) -> logs.Log:
    found, extents, step = [], [], 0.0
    for number in range(len(log.segments)):
        own, step, extent = _of_span(machine, log, number)
        found += own
        extents.append(extent)
    (silent,) = _silent([log], [np.stack(extents)], machine, driven)
    return replace(log, events=events.ordered([*events.joined(found, step), *silent]))


def _of_span(machine: Robot, log: logs.Log, number: int) -> tuple[list[events.Event], float, np.ndarray]:
    """Events of a span of a log, its step [s] and its extent; nothing of it stays in memory."""
    released()
    span = log.segments.around(number, _BESIDE)
    (own,) = _disturbed(machine, [replace(log, segments=(replace(span, core=None),), events=())], among=len(log.segments))
    return events.clipped(own.events, *span.t[[span.core.start, span.core.stop - 1]]), span.step, unwritten.extent(span)


@dataclass(frozen=True)
class Read:
    """An experiment's logs, read once for all who look at them, and what there was to say of them."""

    train: list[logs.Log]
    test: list[logs.Log]
    notices: tuple[str, ...]

    @property
    def parts(self) -> tuple[list[logs.Log], list[logs.Log]]:
        """Of training, and of the test."""
        return self.train, self.test


def read_all(experiment: Experiment, *, structure: Model | None = None) -> Read:
    """The training and the test logs of an experiment.

    Args:
        structure: as of `read`.

    Raises:
        SysidError: as `read`.
    """
    with noticed():  # of the robot the fit says it
        machine = robot.load(experiment.robot, experiment.folder)
    with noticed() as notices:
        parts = [read(experiment, machine, part, structure=structure) for part in (experiment.data.train, experiment.data.test)]
    return Read(*parts, tuple(notices))


