"""Watches rows for changes: learns how they look on sound logs, then judges tick by tick."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..effect import last_link
from ..model import Model
from . import monitor
from .change import Change, settled
from .monitor import PER_TICK, Ticks
from .stream import Rows
from .whitening import whitening

_MEMORY = 30.0  # s: of how large noise is; it tells it to a few per cent


@dataclass(frozen=True)
class Alarm:
    """Torque left what the model foresaw: at `time` [s of the samples given], by a change since
    about `since`. effect, joint: what it is most like. p: of the test that told it."""

    time: float
    since: float
    effect: str
    joint: str
    p: float


class Watch:
    """Watches rows under a held model.

    Args:
        held: (size,) its parameters. each: rows that are averaged. tick: [s]. sound: rows of logs
            on which nothing was changed, for each stretch. alarms: false ones an hour.
    """

    def __init__(
        self,
        model: Model,
        held: np.ndarray,
        each: int,
        tick: float,
        sound: Sequence[Iterable[Rows]],
        alarms: float,
    ):
        self.model, self.held, self.each, self.tick = model, held, each, tick
        self._unsure: np.ndarray | None = None
        parts = [np.concatenate([self._averages(own) for own in rows], axis=1) for rows in sound]
        self._white = whitening(*(np.concatenate(own, axis=1) for own in zip(*map(_seen, parts))))
        white = [self._white(own, _seen(own)[1]) for own in parts]
        self._unsure = monitor.unsure([own[:, :, 14:] for own in white])
        # the model that is watched is the one that the sound logs say, and as sure as these make
        # it: a fit that weighs all joints alike, or noise as white, is less sure than it could be
        own = [(w[:, :, 14:] @ self._unsure, w[:, :, 13]) for w in white]
        better = self._unsure @ sum(np.einsum("jnr,jn->r", a, r) for a, r in own)
        self.held = self.held + better
        for w in white:
            w[:, :, 13] -= w[:, :, 14:] @ better
        ticks = None
        for own in white:
            own = np.concatenate([own[:, :, :14], own[:, :, 14:] @ self._unsure], axis=2)
            n = own.shape[1] // PER_TICK * PER_TICK
            some = monitor.ticks_of(own[:, :n], np.zeros(n // PER_TICK), PER_TICK)
            ticks = some if ticks is None else ticks + some
        lengths = [max(1, round(window / tick)) for window in monitor.WINDOWS]
        self._level = monitor.calibrated(ticks, lengths, alarms, tick)
        self._lengths = lengths[: len(self._level.inflation)]
        self._waiting: deque[tuple[np.ndarray, np.ndarray]] = deque()
        self._size = np.ones(self.model.robot.dof)
        self.clear()

    def clear(self) -> None:
        """Take the alarm back; what was seen before does not count for the next."""
        self.alarm: Alarm | None = None
        self._ticks: Ticks | None = None
        self._since: Ticks | None = None
        self.gap()

    def gap(self) -> None:
        """The next row does not follow on the last: let the filters of the noise begin anew."""
        order = self._white.order
        self._before = np.zeros((self.model.robot.dof, order, 14 + self._unsure.shape[1]))
        self._fresh = -(-order // PER_TICK)  # ticks until they are full

    @property
    def change(self) -> Change | None:
        """What changed since the alarm, by all rows since it began: what it is, too, as the first
        rows may have spoken for something else."""
        if self.alarm is None or not len(self._since.t):
            return None
        robot, which = self.model.robot, int(np.argmax(monitor.explained(self._since)))
        wide = float(np.sqrt(self._level.inflation[:, which].max()))
        return settled(*monitor.names(robot.joints)[which], robot, self._since, wide)

    def add(self, rows: Rows) -> Alarm | None:
        """Take rows in; the alarm where they raise one."""
        averages = np.concatenate([self._before, self._averages(rows)], axis=1)
        self._before = averages[:, averages.shape[1] - self._white.order :]
        t = rows.t[self.each * PER_TICK - 1 :: self.each * PER_TICK]
        white = self._white(averages, _seen(averages)[1])
        ticks = monitor.ticks_of(self._sized(white), t, PER_TICK)
        if self._fresh:
            skipped = min(self._fresh, len(ticks.t))
            self._fresh -= skipped
            ticks = ticks[skipped:]
        if self.alarm is not None:
            self._since = self._since + ticks
            return None
        known = ticks if self._ticks is None else self._ticks + ticks
        self.alarm = self._judged(known, len(ticks.t))
        if self.alarm is not None:
            # the tick in which it began is partly of before
            self._since = known[known.t > self.alarm.since + 1.5 * self.tick]
        self._ticks = known[max(0, len(known.t) - max(self._lengths)) :]
        return self.alarm

    def _sized(self, white: np.ndarray) -> np.ndarray:
        """Innovations (dof, n, ...) of unit variance where noise is larger than on the sound logs:
        in units of what it was over half a minute, until before the longest window."""
        squares = (white[:, :, 13] ** 2).reshape(len(white), -1, PER_TICK).sum(axis=2)
        counted = (white[:, :, 2] != 0.0).reshape(len(white), -1, PER_TICK).sum(axis=2)
        sizes = np.empty(squares.shape)
        for k, own in enumerate(zip(squares.T, counted.T)):
            self._waiting.append(own)
            if len(self._waiting) > max(self._lengths):
                square, count = self._waiting.popleft()
                self._size += (square - count * self._size) * (self.tick / PER_TICK / _MEMORY)
            sizes[:, k] = np.maximum(self._size, 1.0)
        return white / np.sqrt(np.repeat(sizes, PER_TICK, axis=1))[:, :, None]

    def _averages(self, rows: Rows) -> np.ndarray:
        """(dof, n, 14 + ...) columns of every change, the residual, and the model's own columns, in
        the coordinates in which its uncertainty is one where that is known; averaged."""
        dof, n, size = rows.columns.shape
        out = np.empty((dof, n, 14 + size))
        use, qd = rows.use.T, rows.qd.T
        out[..., 0], out[..., 1], out[..., 2] = np.sign(qd) * use, qd * use, use
        last = 10 * last_link(self.model.robot)
        out[..., 3:13] = rows.columns[:, :, last : last + 10]
        out[..., 13] = rows.tau.T - rows.columns @ self.held
        out[..., 14:] = rows.columns
        mean = out.reshape(dof, n // self.each, self.each, 14 + size).mean(axis=2)
        if self._unsure is None:
            return mean
        return np.concatenate([mean[..., :14], mean[..., 14:] @ self._unsure], axis=2)

    def _judged(self, known: Ticks, new: int) -> Alarm | None:
        """The first alarm that the last `new` ticks raise."""
        best = None
        for window, length in enumerate(self._lengths):
            if len(known.t) < length or not new:
                continue
            sums = monitor.windows_of(known[max(0, len(known.t) - new - length + 1) :], length)
            logs = monitor.p_values(sums, self._level, window)
            over = np.flatnonzero((logs < np.log(self._level.p)).any(axis=1))
            if len(over) and (best is None or sums.t[over[0]] < best[0]):
                best = sums.t[over[0]], logs[over[0]]
        if best is None:
            return None
        here, logs = best
        return self._named(known[known.t <= here], float(np.exp(logs.min())))

    def _named(self, known: Ticks, p: float) -> Alarm:
        """What changed, and since when: the onset and the change that explain most."""
        longest = min(len(known.t), max(self._lengths))
        chances = [monitor.explained(known[-length:]) for length in range(1, longest + 1)]
        length, change = np.unravel_index(np.argmax(chances), np.shape(chances))
        effect, joint = monitor.names(self.model.robot.joints)[int(change)]
        end = float(known.t[-1])
        return Alarm(end, end - (int(length) + 1) * self.tick, effect, joint, p)


def _seen(averages) -> tuple[np.ndarray, np.ndarray]:
    """The residual (dof, n) of averages, and which (dof, n) are of rows that all count."""
    return averages[:, :, 13], averages[:, :, 2] > 1.0 - 1e-9
