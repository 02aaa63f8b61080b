"""Logs as a check has them: what their rows tell, as they were measured, and the logs as they are
used.

Of a long one every row is looked at span by span, and stretches spread over it stand in memory, for
what holds of a log as a whole: order, signs, units, delays, excitation, masses.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from .. import experiment_logs, long_log
from .. import log as logs
from ..free_memory import released
from ..log_spec import LogSpec
from ..recording import Recording
from ..robot import Robot
from ..spans import Spans, edges
from ..specs import Experiment
from ..thinning import thinned
from .samples import Samples
from .tally import Tally, speeds, tallied


@dataclass(frozen=True)
class Logged:
    """One log: part "train" or "test", its entry in the experiment file, the file; what its rows
    tell; its samples as measured, and the log in segments, with its events. Of a long one these
    samples and segments are stretches spread over it."""

    part: str
    spec: LogSpec
    path: Path
    step: float
    tally: Tally
    shown: tuple[Samples, ...]
    log: logs.Log

    @property
    def samples(self) -> int:
        """How many there are, shown or not."""
        return self.tally.samples

    def column(self, name: str, joint: int) -> np.ndarray:
        """The samples (n,) of a joint's "q" or "tau" that are shown."""
        return np.concatenate([getattr(own, name)[:, joint] for own in self.shown])

    def speeds(self, joint: int) -> np.ndarray:
        """Sizes (n,) of a joint's speed over short spans in the samples that are shown."""
        return np.concatenate([speeds(own.t, own.q[:, joint], self.step) for own in self.shown])


def read(experiment: Experiment, machine: Robot) -> tuple[Logged, ...]:
    """The training and the test logs of an experiment, what was recorded in one go by itself.

    Raises:
        SysidError: as a fit would.
    """
    data, out = experiment.data, []
    how = (data, machine.joints, machine.prismatic, experiment.folder, experiment.actuator)
    for part in ("train", "test"):
        specs = getattr(data, part)
        taken = [_taken(spec, how) for spec in specs]
        read = [log for log, _ in taken]
        found = experiment_logs.with_events(machine, read, driven=experiment.actuator)
        for spec, (_, told), whole, log in zip(specs, taken, found, thinned(found)):
            if isinstance(whole.segments, Spans):
                out.append(_long(part, spec, told, whole, log, machine))
            else:
                each = [told.rows(*rows) for rows in told.parts]
                out += [_logged(part, spec, one, log, machine) for one in each]
    return tuple(out)


def _taken(spec: LogSpec, how: tuple) -> tuple[logs.Log, Recording | None]:
    """A log of an experiment and its samples as measured: None of what is read span by span."""
    if (log := long_log.in_spans(spec, *how)) is not None:
        return log, None
    told = logs.measured(spec, *how)
    log = logs.assembled(told, spec, *how[:3])
    # segments go to what was recorded in one go; of spans these are not told
    return (log if len(told.parts) > 1 else long_log.spanned(log)), told


def _logged(part: str, spec: LogSpec, samples: Recording, log: logs.Log, machine: Robot) -> Logged:
    """What was recorded in one go, with its own part of the log."""
    t = samples.t
    inside = lambda at: t[0] <= at <= t[-1]  # noqa: E731
    segments = tuple(s for s in log.segments if inside(0.5 * (s.t[0] + s.t[-1])))
    events = tuple(e for e in log.events if inside(e.start))
    own = replace(log, segments=segments, events=events)
    shown, step = _samples(samples), float(np.median(np.diff(t)))
    tally = tallied(_in_parts(shown), step, machine)
    return Logged(part, spec, log.path, step, tally, (shown,), own)


def _long(part: str, spec, samples: Recording | None, whole, log, machine: Robot) -> Logged:
    """A log in spans, of which stretches stand in `log`."""
    shown = tuple(Samples(s.t, s.q, s.tau) for s in log.segments)
    step = float(np.median(np.concatenate([np.diff(own.t) for own in shown])))
    parts = _of_spans(whole.segments) if samples is None else _in_parts(_samples(samples))
    return Logged(part, spec, log.path, step, tallied(parts, step, machine), shown, log)


def _samples(recorded: Recording) -> Samples:
    return Samples(recorded.t, recorded.signals["q"], recorded.signals["tau"])


def _in_parts(whole: Samples) -> Iterator[Samples]:
    for first, last in pairwise(edges(len(whole.t))):
        part = slice(first, last)
        yield Samples(whole.t[part], whole.q[part], whole.tau[part])


def _of_spans(segments: Spans) -> Iterator[Samples]:
    for span in map(segments.measured, range(len(segments))):
        released()
        yield Samples(span.t, span.q, span.tau)
