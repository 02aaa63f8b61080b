"""What else a robot may be asked to do: moves from point to point with stops, or slow sines."""

import numpy as np

from ..errors import SysidError
from ..robot import Robot
from . import motion
from .motion import Reference

KINDS = ("exciting", "moves", "sines")
_DWELL = (0.2, 2.0)  # s between two moves
_MOVING = 0.6  # chance that a joint takes part in a move
_PACE = (0.4, 1.0)  # of the top speed, of the joint that sets a move's time
_SHORTEST = 0.5  # s of a move, for an arm of a metre
_RAMP = (0.2, 0.4)  # of a trapezoid's time, to come to speed, and to stop
_SINE = (0.05, 0.15)  # Hz, for an arm of a metre
_AMPLITUDE = (0.5, 0.9)  # of the half range


def draw(
    kind: str, robot: Robot, t, rng: np.random.Generator, *, speed: float | None = None,
    band: tuple[float, float] | None = None,
) -> Reference:  # fmt: skip
    """A random motion of a kind over times t (n,) [s], from rest at t[0].

    Args:
        kind: exciting, moves or sines.
        speed: top speed [rad/s]; band: lines of the exciting one [Hz].

    Raises:
        SysidError: there is no such kind.
    """
    if kind not in KINDS:
        raise SysidError(f"--motion {kind}", allowed=", ".join(KINDS))
    if kind == "exciting":
        return motion.draw(robot, t, rng, speed=speed, band=band)
    return (moves if kind == "moves" else sines)(robot, t, rng, motion.top_speeds(robot, speed))


def sines(robot: Robot, t, rng: np.random.Generator, top) -> Reference:
    """q = middle + A sin(2 pi f t + phase), each joint its own; a poor first log.

    Args:
        top: top speeds (dof,) [rad/s].
    """
    middle, half = motion.room(robot)
    omega = 2.0 * np.pi * rng.uniform(*_SINE, robot.dof) * motion.quickness(robot)
    amplitude = np.minimum(half * rng.uniform(*_AMPLITUDE, robot.dof), top / omega)
    angle = omega * (t - t[0])[:, None] + rng.uniform(0.0, 2.0 * np.pi, robot.dof)
    waves = np.stack([np.sin(angle), omega * np.cos(angle), -(omega**2) * np.sin(angle)])
    return motion.faded(t, middle, amplitude * waves)


def moves(robot: Robot, t, rng: np.random.Generator, top) -> Reference:
    """Moves of some joints to random places, in step, the rest at rest, with a stop after each.

    A move is of least jerk, s = 10 u^3 - 15 u^4 + 6 u^5, or its speed a trapezoid. At rest, speed
    and acceleration are exactly zero.

    Args:
        top: top speeds (dof,) [rad/s].
    """
    middle, half = motion.room(robot)
    quick = motion.quickness(robot)
    out = np.zeros((3, len(t), robot.dof))
    here = middle + half * rng.uniform(-0.5, 0.5, robot.dof)
    now, before = t[0], 0
    while now < t[-1]:
        now += rng.uniform(*_DWELL)
        goes = rng.random(robot.dof) < _MOVING
        goes[int(rng.integers(robot.dof))] = True
        way = np.where(goes, middle + half * rng.uniform(-1.0, 1.0, robot.dof) - here, 0.0)
        ramp = rng.uniform(*_RAMP) if rng.random() < 0.5 else None
        steepest = 15.0 / 8.0 if ramp is None else 1.0 / (1.0 - ramp)
        least = float(np.max(np.abs(way) / top))
        lasts = max(steepest * least / rng.uniform(*_PACE), _SHORTEST / quick)
        first, last = np.searchsorted(t, [now, now + lasts])
        s, s1, s2 = _profile((t[first:last] - now) / lasts, ramp)
        out[0, before:first] = here
        out[0, first:last] = here + s[:, None] * way
        out[1, first:last] = s1[:, None] * way / lasts
        out[2, first:last] = s2[:, None] * way / lasts**2
        here, now, before = here + way, now + lasts, last
    out[0, before:] = here
    return Reference(t, *out)


def _profile(u, ramp: float | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Place, speed and acceleration (n,) of a move of length 1 in time 1, at times u (n,)."""
    if ramp is None:
        place = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        return place, 30.0 * u**2 * (1.0 - u) ** 2, 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)
    fast = 1.0 / (1.0 - ramp)
    up, down = np.minimum(u, ramp), np.maximum(u - (1.0 - ramp), 0.0)
    speed = fast * (up - down) / ramp
    place = fast * (up**2 / (2.0 * ramp) + (u - up) - down**2 / (2.0 * ramp))
    pushes = np.where(u < ramp, 1.0, np.where(u > 1.0 - ramp, -1.0, 0.0))
    return place, speed, pushes * fast / ramp
