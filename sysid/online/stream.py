"""Samples as they come -> rows of the equation of motion, the same that a batch fit sees.

The filter is the experiment's own Savitzky-Golay polynomial, which needs half a window of samples
after a row: rows come so much late, and are then what they are in a batch fit, to the last bit but
for rounding. Torque is taken as logged. A joint's rows slower than `standstill` do not count, as
with `preprocess.standstill: SPEED`; what a batch fit leaves out by looking at the whole log (rows
about reversals, events) is not known here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import ConfigError, SysidError
from ..model import Model
from ..motion import Piece
from ..smoother import Smoother
from ..specs import PreprocessSpec

MOST = 2048  # rows that are worked on at once


@dataclass(frozen=True)
class Rows:
    """Rows (n,) at times t [s]: measured torque tau (n, dof); use (n, dof) bool; qd (n, dof);
    columns (dof, n, size), zero where a row does not count."""

    t: np.ndarray
    tau: np.ndarray
    use: np.ndarray
    qd: np.ndarray
    columns: np.ndarray


class Stream:
    """Takes samples, gives rows in whole ticks.

    Args:
        step: [s] between samples. standstill: (dof,) or a number [rad/s or m/s]. tick: rows that
            are given together, or a multiple.
    """

    def __init__(self, model: Model, spec: PreprocessSpec, step: float, standstill, tick: int):
        if spec.filter != "savitzky-golay" or spec.torque != "raw" or spec.window == "auto":
            raise ConfigError(
                f"preprocess of {spec.filter} with torque {spec.torque} looks at a whole log",
                where="Online", allowed="savitzky-golay with a window in seconds, torque: raw",
                do="fit it so",
            )  # fmt: skip
        behind = [
            effect.name for effect, _ in model.terms if effect.memory or not effect.instantaneous
        ]
        if behind:
            raise SysidError(
                f"{behind[0]} looks back in time or at other signals", where="Online",
                allowed="effects that look at one instant", do="leave it out of the model",
            )  # fmt: skip
        self.model, self.step, self.tick = model, step, tick
        self.smoother = Smoother(spec, step)
        self.standstill = np.broadcast_to(np.asarray(standstill, dtype=float), (model.robot.dof,))
        self.given = 0  # rows so far
        self._q = np.zeros((0, model.robot.dof))
        self._tau = np.zeros((0, model.robot.dof))
        self._waiting: list[tuple[np.ndarray, np.ndarray]] = []
        self._count = 0

    @property
    def late(self) -> float:
        """Seconds by which rows are late: half the filter's window."""
        return self.smoother.reach * self.step

    def add(self, q, tau) -> list[Rows]:
        """Samples q, tau, (dof,) or (n, dof), and the rows that are whole with them.

        Raises:
            SysidError: shapes that are not alike, or values that are no finite numbers.
        """
        q, tau = (np.atleast_2d(np.asarray(values, dtype=float)) for values in (q, tau))
        dof = self.model.robot.dof
        if q.shape != tau.shape or q.shape[1] != dof:
            raise SysidError(
                f"q is {q.shape} and tau {tau.shape}", where="Online.add",
                allowed=f"both ({dof},), or both (n, {dof})",
            )  # fmt: skip
        self._waiting.append((q, tau))
        self._count += len(q)
        if len(self._q) + self._count < 2 * self.smoother.reach + self.tick:
            return []
        arrived = [np.concatenate(parts) for parts in zip(*self._waiting)]
        self._waiting, self._count = [], 0
        if not all(np.isfinite(values).all() for values in arrived):
            raise SysidError("a sample is no finite number", where="Online.add", do="leave it out")
        self._q, self._tau = (np.concatenate(p) for p in zip((self._q, self._tau), arrived))
        reach, out = self.smoother.reach, []
        while (n := (len(self._q) - 2 * reach) // self.tick * self.tick) > 0:
            n = min(n, max(MOST // self.tick, 1) * self.tick)
            out.append(self._rows(self._q[: n + 2 * reach], self._tau[reach : n + reach]))
            self._q, self._tau = self._q[n:], self._tau[n:]
        return out

    def gap(self) -> None:
        """The next sample does not follow on the last: what is not whole is dropped."""
        self._q, self._tau = self._q[:0], self._tau[:0]
        self._waiting, self._count = [], 0

    def _rows(self, samples, tau) -> Rows:
        reach, n = self.smoother.reach, len(tau)
        q, qd, qdd = (v[reach : reach + n] for v in self.smoother.differentiate(samples))
        t = self.step * (self.given + reach + np.arange(n))
        self.given += n
        nothing = np.zeros(q.shape[1])
        piece = Piece(
            log=0, step=self.step, t=t, q=q, qd=qd, qdd=qdd, tau=tau, measured=tau, signals={},
            use=None, smoother=None, core=slice(0, n), rest=nothing, noise=nothing,
        )  # fmt: skip
        use = np.abs(qd) >= self.standstill
        columns = np.zeros((q.shape[1], n, self.model.size))
        for joint, values in enumerate(self.model.columns(piece, slice(0, n))):
            columns[joint][:, self.model.support(joint, piece)] = (values * use[:, joint]).T
        return Rows(t, np.where(use, tau, 0.0), use, qd, columns)
