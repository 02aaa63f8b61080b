"""A model that follows: samples in, parameters and alarms out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from .. import experiment_logs, pipeline
from ..errors import SysidError
from ..estimate import Fit
from ..filters import settled
from ..log_spec import LogSpec
from ..prior_weight import number
from ..run import Run, read_run
from ..warned import noticed
from .change import Change
from .follow import Follower
from .monitor import WINDOWS
from .stream import MOST, Rows, Stream
from .watch import PER_TICK, Alarm, Watch

_AVERAGED = 0.016  # s: finer than any change that is asked for, coarser than white noise
_LEARNED = 300.0  # s of sound logs: the level of the test hardly falls beyond
_SAME = 0.01  # of a step: two rates that are one


class Online:
    """Follows a robot whose model was fitted, sample by sample.

        online = sysid.Online("runs/mine", rate=1000.0, memory=60.0)
        for q, tau in samples:
            if alarm := online.add(q, tau):
                print(alarm, online.change)
        online.x, online.bodies

    Rows are late by half the window of the experiment's filter (`late`), and come in ticks of about
    an eighth of a second. With `memory=None` nothing is forgotten, and `x` is the optimum that
    `sysid.fit` finds on the same rows (`preprocess: {standstill: SPEED, events: keep}`).

    Args:
        model: a run folder, a `Run` or a `Fit`. rate: samples a second. memory: [s] over which what
            was seen is forgotten (its weight falls to 1/e), None to forget nothing.
        standstill: [rad/s or m/s] (one, or one a joint) below which a joint's rows do not count.
        sound: logs on which nothing was changed, to learn how the residual looks then; by default
            the experiment's own logs. alarms: false ones an hour, at most.
        follow, watch: whether parameters are followed, and whether changes are looked for.

    Raises:
        SysidError: effects or a filter that need a whole log, a group of logs whose level is not
            said, or no sound log.
    """

    def __init__(
        self, model: str | Path | Run | Fit, *, rate: float, memory: float | None = None,
        standstill=0.02, sound: Iterable[str | Path] | None = None, alarms: float = 1.0 / 240.0,
        follow: bool = True, watch: bool = True,
    ):  # fmt: skip
        found = read_run(model) if isinstance(model, (str, Path)) else model
        if not rate > 0.0 or (memory is not None and not memory > 0.0):
            raise SysidError(f"rate {rate}, memory {memory}", where="Online", allowed="above 0")
        if not 0.0 < alarms:
            raise SysidError(f"{alarms} alarms an hour", where="Online", allowed="above 0")
        self.experiment, self.held = found.experiment, np.array(found.x)
        self.model = found.model.at({}, found.x)[0]
        step = 1.0 / rate
        each = max(1, round(_AVERAGED / step))
        self._tick = each * PER_TICK
        self.tick = self._tick * step
        spec = found.experiment.preprocess
        spec = settled(spec, found.filters) if isinstance(found, Fit) else spec
        self._begin = lambda: Stream(self.model, spec, step, standstill, self._tick)
        self._stream = self._begin()
        self._follower = self._followed(found, 1.0 if memory is None else np.exp(-step / memory))
        self._follows, self._watch = follow, None
        if watch:
            parts = self.model, self.held, each, self.tick
            self._watch = Watch(*parts, self._sound(sound), alarms)

    def __repr__(self) -> str:
        said = "no alarm" if self.alarm is None else f"{self.alarm.effect} on {self.alarm.joint}"
        return f"<Online {', '.join(self.model.robot.joints)}: {self.time:.6g} s; {said}>"

    @property
    def time(self) -> float:
        """Of the last row that was worked on [s], counted from the first sample."""
        return (self._stream.given + self._stream.smoother.reach) * self._stream.step

    @property
    def late(self) -> float:
        """Seconds by which rows are late: half the filter's window, and less than a tick."""
        return self._stream.late

    @property
    def x(self) -> np.ndarray:
        """The linear parameters (size,) that follow, `Fit.x`'s order; physically possible."""
        return self._follower.x.copy()

    @property
    def bodies(self) -> np.ndarray:
        """(bodies, 10) of `x`."""
        return self.x[: 10 * self.model.bodies].reshape(-1, 10)

    @property
    def alarm(self) -> Alarm | None:
        """The alarm that stands, None where there is none."""
        return None if self._watch is None else self._watch.alarm

    @property
    def change(self) -> Change | None:
        """What changed since the alarm, by all rows since it began, which may speak for another
        change than its first ones did; None without an alarm, and in its first moment."""
        return None if self._watch is None else self._watch.change

    def add(self, q, tau) -> Alarm | None:
        """Samples q [rad or m] and tau [N m or N], (dof,) or (n, dof), `1 / rate` seconds apart.

        Returns:
            the alarm where these raised one, else None. While one stands no other is raised.

        Raises:
            SysidError: shapes that are not alike, or values that are no finite numbers.
        """
        raised = None
        for rows in self._stream.add(q, tau):
            if self._follows:
                self._follower.add(rows)
            if self._watch is not None:
                raised = self._watch.add(rows) or raised
        return raised

    def clear(self) -> None:
        """Take the alarm back; what was seen before does not count for the next."""
        if self._watch is not None:
            self._watch.clear()

    def gap(self) -> None:
        """Say that the next sample does not follow on the last: no row is made across the gap."""
        self._stream.gap()
        if self._watch is not None:
            self._watch.gap()

    def _followed(self, found: Run | Fit, forgetting: float) -> Follower:
        if isinstance(found, Fit):
            held, prior = found.held, found.prior
            weight = found.strength.value
        else:
            names = {p["name"] for p in found.document["parameters"] if p.get("held")}
            held = np.array([c.name in names for c in found.model.coefficients], dtype=bool)
            prior, weight = pipeline.build(found.experiment)[2], number(found.experiment)
        settings = found.experiment.prior.model_copy(update={"weight": weight})
        experiment = found.experiment.model_copy(update={"prior": settings})
        return Follower(experiment, self.model, prior, ~held, forgetting)

    def _sound(self, sound) -> list[Iterator[Rows]]:
        """Rows of each stretch of logs on which nothing was changed, some minutes in all."""
        logs = [LogSpec(file=str(Path(log).resolve())) for log in sound] if sound else None
        step, left = self._stream.step, _LEARNED
        with noticed():
            specs = logs or [*self.experiment.data.test, *self.experiment.data.train]
            read = experiment_logs.read(self.experiment, self.model.robot, specs)
        least, out = 2.0 * (min(WINDOWS) + self.late) + self.tick, []
        for segment in (s for log in read for s in log.segments):
            n = min(len(segment.t), round(left / step))
            if abs(segment.step / step - 1.0) < _SAME and n * step > least:
                out.append(self._rows(segment.q[:n], segment.tau[:n]))
                left -= n * step
        if not out:
            raise SysidError(
                f"the sound logs hold no {least:.2g} s at {1 / step:g} Hz in one piece",
                where="Online", do="give sound=[log, ...], longer ones at the rate of the samples",
            )  # fmt: skip
        return out

    def _rows(self, q, tau) -> Iterator[Rows]:
        """Rows of a log, a few at a time."""
        stream = self._begin()
        for first in range(0, len(q), MOST):
            yield from stream.add(q[first : first + MOST], tau[first : first + MOST])
