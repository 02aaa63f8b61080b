"""Plain functions of the motion of which missing effects are made, whichever effect that may be."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .stretches import Run

_RIPPLES, _WAVES = 4, 256  # of most waves over the span
# times the median of a power: of noise, whose power scatters as an exponential variable, the
# greatest of all waves is as much once in a hundred times
_CLEAR = math.log(100.0 * _WAVES) / math.log(2.0)
_DELAYS = (0.003, 0.006, 0.01, 0.02, 0.04)  # s


@dataclass(frozen=True)
class Motion:
    """Motion of all runs, one after the other: q, v, a (n, dof); of the joint torque as predicted
    and late (n,), sign of motion as friction takes it up (n,), place in the log (n,)."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    torque: np.ndarray
    late: list[np.ndarray]
    lagging: list[np.ndarray]
    time: np.ndarray
    scale: tuple[float, float, float]

    def every(self, rows: np.ndarray) -> "Motion":
        """The rows `rows`, with the scales of all."""
        late, lagging = ([x[rows] for x in xs] for xs in (self.late, self.lagging))
        q, v, a = self.q[rows], self.v[rows], self.a[rows]
        return Motion(q, v, a, self.torque[rows], late, lagging, self.time[rows], self.scale)


@dataclass(frozen=True)
class Kinematics:
    """Motion of all runs without any torque, which all joints share."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    time: np.ndarray
    rows: list[slice]


def kinematics(runs: list[Run]) -> Kinematics:
    """Positions and their derivatives of all runs, one after the other."""
    ends = np.cumsum([0, *(len(run.q) for run in runs)])
    v = [np.gradient(run.q, run.step, axis=0) for run in runs]
    a = [np.gradient(x, run.step, axis=0) for x, run in zip(v, runs)]
    rows = [slice(i, j) for i, j in zip(ends, ends[1:])]
    q, time = np.concatenate([run.q for run in runs]), np.concatenate([run.time for run in runs])
    return Kinematics(q, np.concatenate(v), np.concatenate(a), time, rows)


def motion_of(
    runs: list[Run], at: Kinematics, predicted: list[np.ndarray], joint: int, thin: list[int]
) -> Motion:
    """What a joint's functions are made of: `predicted` (n,) torque of each run [N m or N], of
    which every `thin` samples are looked at in the end."""
    own = at.q[:, joint]
    span = float(np.ptp(own)) or 1.0
    speed = math.sqrt(float(np.mean(at.v[:, joint] ** 2))) or 1.0

    def late(delay: float) -> np.ndarray:
        parts = []
        for torque, run in zip(predicted, runs):
            k = min(max(1, round(delay / run.step)), len(torque) - 1)
            parts.append(np.concatenate([torque[:1].repeat(k), torque])[: len(torque)])
        return np.concatenate(parts)

    lagging = [
        np.concatenate([_lagging(run.q[:, joint], share * span, m) for run, m in zip(runs, thin)])
        for share in (0.01, 0.03, 0.1)
    ]
    # delays that are the same number of samples are one
    steps = sorted({max(1, round(delay / runs[0].step)): delay for delay in _DELAYS}.values())
    return Motion(
        at.q, at.v, at.a, np.concatenate(predicted), [late(d) for d in steps], lagging, at.time,
        (float(own.min()), span, speed),
    )  # fmt: skip


def functions(
    motion: Motion, joint: int, waves: np.ndarray, growing: np.ndarray
) -> list[Callable[[], np.ndarray]]:
    """Functions of the motion of which missing effects are made, each computed (n,) when called.
    waves, growing: as of `ripples`."""
    least, span, typical = motion.scale
    q, v, a, torque = motion.q, motion.v, motion.a, motion.torque
    own, speed = q[:, joint], v[:, joint]
    fast, sign, place = speed / typical, np.sign(speed), math.pi * (own - least) / span
    time = motion.time
    out: list[Callable[[], np.ndarray]] = []
    trig = (np.cos, np.sin)
    # friction: of velocity, load, time and place, and what builds up over a distance
    out += [lambda x=x: x for x in (sign, fast, fast**2, fast**3, sign * fast**2)]
    out += [lambda x=x: x for x in (fast * torque, sign * torque, sign * np.abs(torque))]
    for slow in (0.05, 0.2, 0.7):
        out += [lambda s=s, slow=slow: s * np.exp(-np.abs(fast) / slow) for s in (sign, 1.0)]
    out += [lambda s=s, k=k: s * time**k for k in (1, 2) for s in (1.0, sign, fast)]
    out += [lambda k=k, f=f: sign * f(k * place) for k in range(1, 7) for f in trig]
    out += [lambda x=x: x for x in motion.lagging]
    # the drive: gain, saturation, delay, ripple
    out += [lambda k=k: torque**k for k in (1, 2, 3)]
    out += [lambda x=x: x for x in motion.late]
    out += [lambda k=k, f=f: f(k * place) for k in range(1, 9) for f in trig]
    size = np.abs(fast)
    out += [lambda k=k, f=f: f(k * own) for k in (*waves, *growing) for f in trig]
    out += [lambda k=k, f=f: size * f(k * own) for k in growing for f in trig]
    # the bodies
    for k in range(q.shape[1]):
        out += [lambda x=x: x for x in (a[:, k], v[:, k])]
        out += [lambda k=k: v[:, k] * speed, lambda k=k: v[:, k] ** 2, lambda k=k: np.sign(v[:, k])]
        for angle in (q[:, k], own + q[:, k], own - q[:, k]):
            for f in trig:
                out += [lambda x=angle, f=f: f(x), lambda x=angle, f=f, k=k: a[:, k] * f(x)]
    return out


def ripples(
    q: np.ndarray, speed: np.ndarray, residual: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Wave numbers [1/rad or 1/m] of the strongest ripples over position (cogging, gear teeth) in a
    residual (n,), and of those that clearly grow with the speed: less one that is always the same,
    they have no mean left at any position."""
    return _ripples(q, residual), _ripples(q, np.abs(speed) * residual, _CLEAR)


def _ripples(q: np.ndarray, residual: np.ndarray, clear: float = 0.0) -> np.ndarray:
    span = np.ptp(q)
    if span == 0.0:
        return np.zeros(0)
    sums, _ = np.histogram(q, 1024, weights=residual - residual.mean())
    # in eighths of a wave over the span; a wave is four bins at least
    power = np.abs(np.fft.rfft(sums, 8 * _WAVES * 4)[: 8 * _WAVES]) ** 2
    peaks = 1 + np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:]))
    # slower ones are among the functions anyway
    peaks = peaks[(peaks > 32) & (power[peaks] >= clear * np.median(power))]
    return 2.0 * math.pi / (8.0 * span) * peaks[np.argsort(-power[peaks])[:_RIPPLES]]


def _lagging(q: np.ndarray, distance: float, thin: int) -> np.ndarray:
    """The sign of motion (n,) as friction takes it up over a distance after each reversal, straight
    between every `thin` samples. Source: Dahl 1968."""
    out, state, every = [], 0.0, q[::thin]
    for moved in (np.diff(every, prepend=every[0]) / distance).tolist():
        state = (state + moved) / (1.0 + abs(moved))
        out.append(state)
    return np.interp(np.arange(len(q)), thin * np.arange(len(every)), out)
