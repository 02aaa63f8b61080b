"""The motion that a simulated robot is asked to make: every joint its own sines, fast and slow, over many poses.

Each joint follows a sum of sines whose lines carry equal speed, run on a clock of its own that slows to a fifth and
back: it meets fast sweeps, creeping passes over the same angles, and reversals of every sharpness.
"""

from dataclasses import dataclass

import numpy as np

from ..robot import Robot

FADE = 1.0  # s from rest into the motion
LINES = 6  # sines a joint
BAND = (0.1, 1.0)  # Hz, for an arm of a metre at 2 rad/s
_ARM_SPEED, _ARM_REACH = 2.0, 0.9  # rad/s, m
_QUICKEST = 4.0  # times the arm's speed
_CLOCK = (0.6, 0.4)  # mean rate of a joint's clock, and how much of it comes and goes
_SHORTEST = 4.0  # s of a clock's round
_SWING, _STROKE = 1.5, 0.25  # most that a joint moves to either side [rad], [m]
_SLIDE = 0.125  # m/s of a prismatic joint for each rad/s of the others
_OFF_CENTRE = 0.1  # of the reach: how far a log's middle pose is from the limits' middle
_USED = 0.9  # of the range between the limits


@dataclass(frozen=True)
class Reference:
    """t (n,), and q, qd, qdd (n, dof) that the controller is to follow."""

    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray


def reach(robot: Robot) -> float:
    """Length [m] of the longest chain of links, the last one's centre of mass its end."""
    lengths: list[float] = []
    for row, parent in enumerate(robot.parents):
        lengths.append((lengths[parent] if parent >= 0 else 0.0) + (np.linalg.norm(robot.translations[row]) if parent >= 0 else 0.0))
    ends = [lengths[body.row] + np.linalg.norm(pi[1:4]) / pi[0] for body, pi in zip(robot.bodies, robot.prior) if body.kind == "link"]
    return float(max(ends))


def quickness(robot: Robot) -> float:
    """How many times faster than an arm of a metre a robot of this size moves: small ones swing faster."""
    return float(np.clip(_ARM_REACH / max(reach(robot), 1e-3), 1.0, _QUICKEST))


def top_speeds(robot: Robot, speed: float | None = None) -> np.ndarray:
    """Top speed (dof,) [rad/s or m/s] of each joint; `speed` [rad/s] replaces the one that the robot's size suggests."""
    speed = _ARM_SPEED * quickness(robot) if speed is None else speed
    if robot.prismatic.all():
        return np.full(robot.dof, speed)
    return np.where(robot.prismatic, _SLIDE * speed, speed)


def room(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Middle (dof,) and half range (dof,) [rad or m] that each joint may use."""
    low, high = robot.limits.T
    limited = np.isfinite(low) & np.isfinite(high) & (high > low)
    most = np.where(robot.prismatic, _STROKE, _SWING)
    half = np.where(limited, np.minimum(most, 0.5 * _USED * np.where(limited, high - low, 0.0)), most)
    # the zero pose where it leaves that room, else the middle of the limits
    middle = np.where(limited, np.clip(0.0, np.where(limited, low, 0.0) + half / _USED, np.where(limited, high, 0.0) - half / _USED), 0.0)
    return middle, half


def draw(robot: Robot, t, rng: np.random.Generator, *, speed: float | None = None, band: tuple[float, float] | None = None) -> Reference:
    """A random motion over times t (n,) [s], from rest at t[0].

    Args:
        speed: top speed [rad/s]. band: lowest and highest line [Hz]; both follow the robot's size where they are None.
    """
    top = top_speeds(robot, speed) * rng.uniform(0.85, 1.15, robot.dof)
    if band is None:
        scale = quickness(robot) if speed is None else speed / _ARM_SPEED
        band = (BAND[0] * scale, BAND[1] * scale)
    middle, half = room(robot)
    middle = middle + _OFF_CENTRE * half * rng.uniform(-1.0, 1.0, robot.dof)
    half = (1.0 - _OFF_CENTRE) * half
    out = np.zeros((3, len(t), robot.dof))
    for j in range(robot.dof):
        out[:, :, j] = _joint(t, rng, top[j], half[j], band)
    return faded(t, middle, out)


def faded(t, middle, out) -> Reference:
    """Motion out (3, n, dof), q, qd, qdd about a middle pose (dof,), begun from rest there at t[0]."""
    u = np.clip((t - t[0]) / FADE, 0.0, 1.0)[:, None]
    fade, fade1, fade2 = u**3 * (10 - 15 * u + 6 * u**2), 30 * u**2 * (1 - u) ** 2 / FADE, 60 * u * (1 - u) * (1 - 2 * u) / FADE**2
    q, qd, qdd = out
    return Reference(t, middle + fade * q, fade * qd + fade1 * q, fade * qdd + 2 * fade1 * qd + fade2 * q)


def _joint(t, rng, top: float, half: float, band) -> np.ndarray:
    """q, qd, qdd (3, n) of one joint about its middle pose: |qd| <= top, |q| <= half."""
    edges = np.geomspace(*band, LINES + 1)
    omega = 2.0 * np.pi * rng.uniform(edges[:-1], edges[1:])
    phase = rng.uniform(0.0, 2.0 * np.pi, LINES)
    mean, swing = _CLOCK
    slow = 2.0 * np.pi / max(0.5 * (t[-1] - t[0]), _SHORTEST) * rng.uniform(0.8, 1.25)
    start = rng.uniform(0.0, 2.0 * np.pi)
    s = mean * (t - t[0]) + swing / slow * np.sin(slow * t + start)
    rate, rate1 = mean + swing * np.cos(slow * t + start), -swing * slow * np.sin(slow * t + start)

    def lines(omega):
        angle = omega * s[:, None] + phase
        x, x1, x2 = (np.sin(angle) / omega).sum(1), np.cos(angle).sum(1), (-np.sin(angle) * omega).sum(1)
        x = x - 0.5 * (x.min() + x.max())
        q, qd, qdd = x, x1 * rate, x2 * rate**2 + x1 * rate1
        return np.stack([q, qd, qdd]) * top / np.abs(qd).max()

    out = lines(omega)
    span = np.abs(out[0]).max()
    if span > half:  # faster lines keep the speed where there is little room
        out = lines(omega * min(span / half, 2.5))
        out = out * min(1.0, half / np.abs(out[0]).max())
    return out
