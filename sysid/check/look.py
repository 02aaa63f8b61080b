"""What a check looks at: the logs, their motion under a low-pass, what the robot and a fit say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .. import experiment_logs, filters, pipeline
from ..errors import SysidError
from ..estimate import Fit
from ..events import UNWRITTEN
from ..lowpass import band, lowpassed, stride_of, widest
from ..model import Model
from ..motion import Motion
from ..plain_model import plain
from ..preprocess import unfiltered
from ..robot import Robot
from ..rows import Rows, stack
from ..smoother import Smoother
from ..spans import Spans
from ..specs import Experiment
from ..trusted import Untrusted
from ..warned import noticed
from .equations import FEWEST, Equations
from .logged import Logged, read
from .tally import SPAN

_TRAVELS, _MOVES = (0.1, 0.02), 0.05  # rad, m; rad/s: less tells nothing of a body
_FAR = 5.0  # times that travel, half a radian: gravity tells, however slowly a joint goes so far
_IN_BAND = 4.0  # times the frequency below which speeds stay: tells inertia, and cuts noise off


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
class Moves:
    """How a joint moves in the training logs: whether enough to tell of what it carries; how far it
    travels, its top speed and its speeds (n,), a second."""

    enough: bool
    travel: float
    top: float
    speeds: np.ndarray


@dataclass(frozen=True)
class Look:
    """An experiment, its robot and all its logs; what there is to know of the robot's file."""

    experiment: Experiment
    robot: Robot
    logs: tuple[Logged, ...]
    of_the_robot: tuple[str, ...] = ()

    def part(self, name: str) -> list[Logged]:
        """The logs of "train" or "test"."""
        return [log for log in self.logs if log.part == name]

    @property
    def with_speeds(self) -> list[Logged]:
        """The training logs that are long enough for speeds."""
        return [log for log in self.part("train") if log.samples > 2.0 * SPAN / log.step]

    @cached_property
    def excited(self) -> list[Moves]:
        """Of each joint."""
        return [self._moves(j) for j in range(self.robot.dof)]

    def asked(self, use) -> list[int]:
        """The joints that move enough and of which enough rows (n, dof) are used."""
        enough = np.sum(use, axis=0) > FEWEST
        return [j for j in range(self.robot.dof) if self.excited[j].enough and enough[j]]

    def _moves(self, j: int) -> Moves:
        long, slides = self.with_speeds, bool(self.robot.prismatic[j])
        travel = max(float(log.tally.travel[j]) for log in self.part("train"))
        speeds = np.concatenate([log.speeds(j) for log in long]) if long else np.zeros(1)
        top = float(np.quantile(speeds, 0.99))
        least, slow = _TRAVELS[slides], top < _MOVES * (1.0 if not slides else 0.2)
        enough = travel >= (_FAR * least if slow else least)
        return Moves(enough, travel, top, speeds)

    def column(self, key: str, joint: str) -> str | None:
        """The name of a joint's column of data.columns' `position` or `torque`, None where it goes
        by a number or stands in a matrix."""
        given = getattr(self.experiment.data.columns, key)
        if isinstance(given, str):
            return given.replace("{joint}", joint) if "{joint}" in given else None
        own = given[self.robot.joints.index(joint)]
        return own if isinstance(own, str) else None

    @cached_property
    def seen(self) -> Seen | None:
        """The training motion under a low-pass, with the columns of rigid bodies and of what any
        joint has; None where the logs are too short."""
        return self._seen(self.part("train"))

    @cached_property
    def in_band(self) -> Seen | None:
        """The same of the training logs in little more than the motion's own band: beyond it noise
        of coarse angles, which inertia makes torque of, is more than motion."""
        return self._seen(self.part("train"), _IN_BAND)

    @cached_property
    def every(self) -> Seen | None:
        """The same of all logs, in the order of `logs`."""
        return self._seen(self.logs)

    def _seen(self, logged: Sequence[Logged], times: float = np.inf) -> Seen | None:
        read = [log.log for log in logged]
        cutoff = widest(read, known=(own_band := band(read)))
        cutoff = min(cutoff, times * own_band) if own_band > 0.0 else cutoff
        motion = lowpassed(read, self.robot.joints, cutoff, known=own_band)
        if motion is None or motion.samples < FEWEST:
            return None
        model, stride = plain(self.experiment, self.robot), stride_of(motion, cutoff)
        return Seen(motion, stride, model, stack(model, motion, stride))

    @cached_property
    def fit(self) -> Fit | None:
        """The experiment fitted as it is; None where it cannot be."""
        parts = ([log.log for log in self.part(name)] for name in ("train", "test"))
        if self.experiment.preprocess.events == "keep":
            own = lambda log: tuple(e for e in log.events if e.kind in UNWRITTEN)  # noqa: E731
            parts = ([replace(log, events=own(log)) for log in part] for part in parts)
        try:
            return pipeline.fit(self.experiment, measured=experiment_logs.Read(*parts, ()))
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
    with noticed() as notices:
        machine, *_ = pipeline.build(experiment)
    logs = read(experiment, machine)
    for log in (one.log for one in logs if len(one.log.segments)):  # a fit would refuse them
        if experiment.preprocess.filter == "none":
            unfiltered(log.segments[0])
        elif filters.is_given(experiment):
            slowest = 0.0 if isinstance(log.segments, Spans) else max(s.step for s in log.segments)
            Smoother(experiment.preprocess, slowest or log.segments[0].step)
    return Look(experiment, machine, logs, tuple(notices))
