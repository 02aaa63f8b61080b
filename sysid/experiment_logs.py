"""An experiment's logs as they were measured: read, with their events, and without what it masks."""

from __future__ import annotations

from dataclasses import dataclass, replace

from . import events, long_log, masks, robot
from . import log as logs
from .bumps import bumps
from .free_memory import released
from .log_spec import LogSpec
from .model import Model
from .robot import Robot
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
        found = read if experiment.preprocess.events == "keep" else with_events(machine, read)
    return masks.masked(found, experiment.preprocess.mask, machine.joints)


def _read_one(machine: Robot, kept: str, spec: LogSpec, how: tuple) -> logs.Log:
    log = long_log.read(spec, *how)
    return log if kept == "keep" else with_events(machine, [log])[0]


_BESIDE = 1024  # rows of a span's neighbours that are looked at with it: more than an event's surroundings


def with_events(machine: Robot, read: list[logs.Log], *, among: int = 1) -> list[logs.Log]:
    """Logs with their events: first those that the signals show, then those that only the robot's equations do. Each span of a long
    log is looked at by itself.

    Args:
        among: how many parts their log has, where these are the spans of one.
    """
    if any(isinstance(log.segments, Spans) for log in read):
        return [with_events(machine, [log])[0] if not isinstance(log.segments, Spans) else _with_events_of_spans(machine, log) for log in read]
    told = lambda log, e: not (e.signal == "torque" and set(e.joints) <= set(log.unused))  # noqa: E731
    found = [
        replace(log, events=tuple(e for s in log.segments for e in events.find(s, machine.joints, log=log.name, among=among) if told(log, e))) for log in read
    ]  # fmt: skip
    if among > 1:  # what is looked for in signals leaves half a span's memory free between what is held
        released()
    felt = bumps(machine, found, among=among)
    other = [[e for e in log.events if e.kind != "knock"] for log in found]
    knocks = [[e for e in felt if e.log == log.name] for log in found]
    return [replace(log, events=events.ordered([*own, *more])) for log, own, more in zip(found, other, knocks)]


def _with_events_of_spans(machine: Robot, log: logs.Log) -> logs.Log:
    found, step = [], 0.0
    for number in range(len(log.segments)):
        own, step = _of_span(machine, log, number)
        found += own
    return replace(log, events=events.joined(found, step))


def _of_span(machine: Robot, log: logs.Log, number: int) -> tuple[list[events.Event], float]:
    """Events of a span of a log, and its step [s]; nothing of it stays in memory."""
    released()
    span = log.segments.around(number, _BESIDE)
    (own,) = with_events(machine, [replace(log, segments=(replace(span, core=None),))], among=len(log.segments))
    return events.clipped(own.events, *span.t[[span.core.start, span.core.stop - 1]]), span.step


@dataclass(frozen=True)
class Read:
    """An experiment's logs, read once for all who look at them, and what there was to say of them."""

    train: list[logs.Log]
    test: list[logs.Log]
    notices: tuple[str, ...]


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


