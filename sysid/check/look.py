"""What a check looks at: the samples of every log as they were measured, and as they are used."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from .. import log as logs
from .. import pipeline, robot
from ..errors import SysidError
from ..estimate import Fit
from ..lowpass import lowpassed, stride_of, widest
from ..model import Model, build
from ..motion import Motion
from ..recording import Recording
from ..robot import Robot
from ..rows import Rows, stack
from ..specs import EffectSpec, Experiment, LogSpec
from ..trusted import Untrusted
from .equations import FEWEST, Equations

_HAS = ("armature", "viscous", "coulomb", "torque_bias")  # what any joint has


@dataclass(frozen=True)
class Logged:
    """One log: part "train" or "test", its entry in the experiment file, the file, stamps t (n,)
    [s], angles q and torque tau (n, dof) as measured, and the log in segments with its events."""

    part: str
    spec: LogSpec
    path: Path
    t: np.ndarray
    q: np.ndarray
    tau: np.ndarray
    log: logs.Log

    @property
    def step(self) -> float:
        """Median seconds from sample to sample."""
        return float(np.median(np.diff(self.t)))


@dataclass(frozen=True)
class Seen:
    """A motion, every how many samples of it a row is kept, a model, and its rows."""

    motion: Motion
    stride: int
    model: Model
    rows: Rows

    @property
    def step(self) -> float:
        """Seconds from row to row."""
        return self.stride * self.motion.pieces[0].step

    def columns(self, joint: int) -> np.ndarray:
        """What the model has for a joint's torque (n, k), of one size."""
        own = self.rows.columns[joint]
        size = np.linalg.norm(own, axis=0)
        return own[:, size > 0.0] / size[size > 0.0]


@dataclass(frozen=True)
class Look:
    """An experiment, its robot and all its logs."""

    experiment: Experiment
    robot: Robot
    logs: tuple[Logged, ...]

    def part(self, name: str) -> list[Logged]:
        """The logs of "train" or "test"."""
        return [log for log in self.logs if log.part == name]

    @cached_property
    def seen(self) -> Seen | None:
        """The training motion under a low-pass, with the columns of rigid bodies and of what any
        joint has; None where the logs are too short."""
        found = [log.log for log in self.part("train")]
        cutoff = widest(found)
        motion = lowpassed(found, self.robot.joints, cutoff)
        if motion is None or motion.samples < FEWEST:
            return None
        model, stride = (
            build(self.robot, [EffectSpec(name=n) for n in _HAS]),
            stride_of(motion, cutoff),
        )
        return Seen(motion, stride, model, stack(model, motion, stride))

    @cached_property
    def fit(self) -> Fit | None:
        """The experiment fitted as it is; None where it cannot be."""
        parts = ([log.log for log in self.part(name)] for name in ("train", "test"))
        if self.experiment.preprocess.events == "keep":
            parts = ([replace(log, events=()) for log in part] for part in parts)
        try:
            return pipeline.fit(self.experiment, measured=pipeline.Read(*parts, ()))
        except Untrusted:
            raise
        except SysidError:
            return None

    @cached_property
    def equations(self) -> Equations | None:
        """What the robot of the URDF makes of the training logs; None where they are too short."""
        if self.seen is None:
            return None
        return Equations.of(self.robot, self.seen.motion, self.seen.stride, self.seen.rows)


def looked(experiment: Experiment) -> Look:
    """Read everything that an experiment names. Raises SysidError, as a fit would."""
    experiment = pipeline.started(experiment)
    machine = robot.load(experiment.robot, experiment.folder)
    args = (
        experiment.data, machine.joints, machine.prismatic, experiment.folder, experiment.actuator,
    )  # fmt: skip
    out, unused = [], tuple(experiment.data.unused)
    for part in ("train", "test"):
        specs = getattr(experiment.data, part)
        told = [logs.measured(spec, *args) for spec in specs]
        found = pipeline.with_events(machine, [logs.assembled(one, unused) for one in told])
        for spec, one, log in zip(specs, told, found):
            out += [_logged(part, spec, one.rows(*rows), log) for rows in one.parts]
    return Look(experiment, machine, tuple(out))


def _logged(part: str, spec: LogSpec, samples: Recording, log: logs.Log) -> Logged:
    """What was recorded in one go, with its own part of the log."""
    t, signals = samples.t, samples.signals
    inside = lambda at: t[0] <= at <= t[-1]  # noqa: E731
    segments = tuple(s for s in log.segments if inside(0.5 * (s.t[0] + s.t[-1])))
    events = tuple(e for e in log.events if inside(e.start))
    own = replace(log, segments=segments, events=events)
    return Logged(part, spec, log.path, t, signals["q"], signals["tau"], own)
