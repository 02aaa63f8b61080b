"""What the logs of a lab have in them: spikes, closed brakes, a slow logger, a coarse current.

This is what is done to the log; what the robot itself feels is in `disturbances`.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from ..errors import SysidError
from . import motions
from .disturbances import runs
from .usual_sizes import Scales

_MOST_LOGS, _MOST_KNOCKS, _MOST_SPIKES = 1000, 100, 0.1  # spikes: of the samples
_SPIKE = (5.0, 20.0)  # deviations of a joint's noise
_SCALE = 0.01  # of a joint's torque: stands for a noise that is less
_WIDTHS = (0.6, 0.25, 0.15)  # how often a spike takes one, two, three samples
_FADING = (0.6, 1.0)  # of its height, sample by sample
_LATE = 0.4  # of a step: the most that a jittering logger is early or late


@dataclass(frozen=True)
class Nuisances:
    """knocks: in each log. spikes [1/s], on each joint. brakes: whether joints that rest are
    braked. jitter [s]: deviation of the logger's instants. current: step of the logged torque
    [N m], or a share of each joint's peak, as in "2%"."""

    knocks: int = 0
    spikes: float = 0.0
    brakes: bool = False
    jitter: float = 0.0
    current: float | str | None = None

    def steps(self, scales: Scales) -> np.ndarray | None:
        """Steps (dof,) [N m] of the logged torque; None: not coarse."""
        if self.current is None:
            return None
        amount, share = read_current(self.current)
        return amount * (scales.peak if share else np.ones_like(scales.peak))


def checked(motion, logs, rate, knocks, spikes, brakes, jitter, current) -> Nuisances:
    """What is to be in the logs, of `rate` [Hz]; jitter in ms here. Raises SysidError."""
    for option, value, low, high, unit in (
        ("--logs", logs, 1, _MOST_LOGS, "training logs"),
        ("--knocks", knocks, 0, _MOST_KNOCKS, "in each log"),
        ("--spikes", spikes, 0.0, _MOST_SPIKES * rate, "a second and joint"),
        ("--jitter", jitter, 0.0, 500.0 / rate, "ms, half a step"),
    ):
        if not (math.isfinite(value) and low <= value <= high):
            raise SysidError(f"{option} {value:g}", allowed=f"{low:g} to {high:g} {unit}")
    if motion not in motions.KINDS:
        raise SysidError(f"--motion {motion}", allowed=", ".join(motions.KINDS))
    if brakes and motion != "moves":
        raise SysidError(
            f"--brakes with --motion {motion}, in which no joint rests",
            allowed="--motion moves", do="give both, or neither",
        )  # fmt: skip
    if current is not None:
        read_current(current)
    return Nuisances(knocks, spikes, brakes, 1e-3 * jitter, current)


def read_current(text: float | str) -> tuple[float, bool]:
    """An amount, and whether it is a share of each joint's peak torque. Raises SysidError."""
    found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*(%?)\s*", str(text))
    try:
        amount, share = float(found[1]) * (0.01 if found[2] else 1.0), bool(found[2])
    except (TypeError, ValueError):
        amount, share = math.nan, False
    if not 0.0 < amount <= (0.5 if share else 1e6):
        raise SysidError(
            f"--current {text}",
            allowed="a step [N m], or a share of the peak torque up to 50%, as in 2%",
        )
    return amount, share


def jittered(rows, t, keep: int, period: float, jitter: float, rng):
    """The control periods (n,) whose values a slow logger finds, and its rounded stamps (n,) [s].

    Its instants are late or early; the first is on time, none is off by more than 0.4 of a step.

    Args:
        rows: control periods that it would log on time; t: times [s] of all of them.
        keep: control periods of `period` [s] from one sample to the next. jitter [s].
    """
    step = keep * period
    quantum = 10.0 ** math.floor(math.log10(0.1 * step) + 1e-9)
    late = np.clip(jitter * rng.standard_normal(len(rows)), -_LATE * step, _LATE * step)
    late[0] = 0.0
    instants = np.minimum(t[rows] + late, t[-1])
    found = np.floor((instants - t[0]) / period + 1e-6).astype(int)
    stamps = np.round((instants - instants[0]) / quantum) * quantum
    return np.clip(found, 0, len(t) - 1), np.round(stamps, 9)


def interpolated(t, values, stamps) -> np.ndarray:
    """Values (n, dof) at times t (n,) as they were at stamps (m,) [s]."""
    return np.stack([np.interp(stamps, t, column) for column in values.T], axis=1)


def spike_scale(std, scales: Scales) -> np.ndarray:
    """What spikes (dof,) [N m] are counted in: the noise, or what stands for it."""
    return np.maximum(std, _SCALE * scales.torque)


def spiked(tau, t, rate: float, scale, rng) -> tuple[np.ndarray, list[dict]]:
    """Torque (n, dof) with errors of one to three samples, and where they are.

    Args:
        rate: how many a second and joint. scale (dof,) [N m]: they are 5 to 20 times as large.
    """
    out, events = tau.copy(), []
    for j in range(tau.shape[1]):
        count = rng.poisson(rate * (t[-1] - t[0]))
        for first in np.sort(rng.integers(0, len(t), count)).tolist():
            last = min(first + 1 + int(rng.choice(3, p=_WIDTHS)), len(t))
            height = rng.choice([-1.0, 1.0]) * scale[j] * rng.uniform(*_SPIKE)
            out[first:last, j] += height * rng.uniform(*_FADING, last - first)
            events.append(_event("spike", j, first, last, t))
    return out, events


def braked(closed, sticks, rows, t) -> tuple[np.ndarray, list[dict]]:
    """Where the log (n, dof) says that a brake is closed, and from when to when.

    Args:
        closed, sticks: at all control periods; rows: those that are logged, t (n,) their stamps.
    """
    still = closed & sticks
    still[1:] &= still[:-1].copy()
    away = still[rows]
    joints = range(away.shape[1])
    return away, [_event("brake", j, *run, t) for j in joints for run in runs(away[:, j])]


def _event(kind: str, j: int, first: int, last: int, t) -> dict:
    start, stop = float(t[first]), float(t[last - 1])
    return {"kind": kind, "start": start, "stop": stop, "joints": [j], "rows": [first, last]}
