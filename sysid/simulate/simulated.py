"""What a simulation gives: logs, and the truth under them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..robot import Robot


@dataclass(frozen=True)
class Clean:
    """What no sensor saw, at the times of the log: q, qd (n, dof) of the motors, `read` what an encoder without rounding reads
    of them, link_q, link_qd of the links, the torque tau that acted (asked for of the drives), logged torque without noise, and
    which joints stick (n, dof)."""

    q: np.ndarray
    qd: np.ndarray
    link_q: np.ndarray
    link_qd: np.ndarray
    tau: np.ndarray
    sensed: np.ndarray
    sticks: np.ndarray
    read: np.ndarray


@dataclass(frozen=True)
class SimulatedLog:
    """t (n,), q and tau (n, dof) as logged; `clean` as they were; `noise` (dof,) RMS of the noise, and of rounding, in the torque,
    without `events`: knocks, spikes and closed brakes, {kind, start, stop, joints, ...}."""

    t: np.ndarray
    q: np.ndarray
    tau: np.ndarray
    clean: Clean
    noise: np.ndarray
    events: tuple[dict, ...] = ()


@dataclass(frozen=True)
class Simulation:
    """Logs of different motions of one robot, and what is true of it. logs: by name, train or train_1, train_2, ..., then test."""

    robot: Robot
    logs: dict[str, SimulatedLog]
    truth: dict

    @property
    def train(self) -> SimulatedLog:
        """The first training log."""
        return next(iter(self.logs.values()))

    @property
    def test(self) -> SimulatedLog:
        """The log held out."""
        return self.logs["test"]
