"""Closed loop in time: the controller and its encoder, the true robot, the torque sensor; twice, for two logs.

The control period is at most a millisecond; a slower log keeps every so many of its samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import SysidError
from ..regressor import torque as inverse_dynamics
from ..robot import Robot
from . import control, motion, parts
from . import truth as drawn
from .hidden import CATALOGUE, Hidden, check, settled
from .plant import Plant, Truth

LEAD = 1.0  # s before logging starts: a robot at rest has no friction law
_PERIOD = 1e-3  # s of the controller, at most
_SOFT_SPEED = 0.05  # of the top speed, where the friction that the controller expects changes sign


@dataclass(frozen=True)
class Clean:
    """What no sensor saw, at the times of the log: q, qd (n, dof) of the motors, link_q, link_qd of the links, the torque tau
    that acted (asked for of the drives), logged torque without noise, and which joints stick (n, dof)."""

    q: np.ndarray
    qd: np.ndarray
    link_q: np.ndarray
    link_qd: np.ndarray
    tau: np.ndarray
    sensed: np.ndarray
    sticks: np.ndarray


@dataclass(frozen=True)
class SimulatedLog:
    """t (n,), q and tau (n, dof) as logged; `clean` as they were; `noise` (dof,) RMS of what was added to the torque."""

    t: np.ndarray
    q: np.ndarray
    tau: np.ndarray
    clean: Clean
    noise: np.ndarray


@dataclass(frozen=True)
class Simulation:
    """Two logs of two motions of one robot, and what is true of it."""

    robot: Robot
    train: SimulatedLog
    test: SimulatedLog
    truth: dict


def simulate(
    robot: Robot, *, hide: Sequence[Hidden | Callable] = (), seed: int = 0, duration: float = 20.0, rate: float = 1000.0,
    noise: float | None = None, colour: float | None = None, share: float = 0.5, encoder: int | None = None,
    speed: float | None = None, band: tuple[float, float] | None = None, progress: Callable[[str, float], None] | None = None,
) -> Simulation:  # fmt: skip
    """Simulate a training and a test log. Everything follows from the arguments.

    Args:
        robot: its prior is what the controller believes; the truth is drawn about it.
        hide: effects, or functions torque(q, qd, qdd, t, load, memory) -> (dof,) [N m] to overcome, which are called once
            a control period; `memory` is a dict of their own in each log.
        seed: of everything random. duration [s] of each log; rate [Hz] of logging.
        noise: standard deviation of the torque noise [N m]; None: 1 to 2 % of each joint's rms torque.
        colour: time constant [s] of the coloured `share` of its variance; None: white.
        encoder: bits a turn of the motor, or of the joint where it has no rotor (a metre of a prismatic joint); 0: exact;
            None: 14 on the motor, behind a gear of 100 where it has no rotor.
        speed: top speed [rad/s]; band: lowest and highest line [Hz]; None: by the robot's size.

    Raises:
        SysidError: an argument that cannot be, or a robot that does not follow its reference.
    """
    _check(duration, rate, noise, colour, share, encoder, speed, band)
    named, custom = [h for h in hide if isinstance(h, Hidden)], [h for h in hide if not isinstance(h, Hidden)]
    _check_hidden(named, custom, robot)
    keep = math.ceil(1.0 / (rate * _PERIOD) - 1e-9)
    period = 1.0 / (rate * keep)
    t = period * np.arange(-math.ceil(LEAD / period / keep) * keep, round(duration / period) + 1)
    streams = ("bodies", "friction", "hidden", "train motion", "train noise", "test motion", "test noise", "bursts")
    random = lambda name: np.random.default_rng([seed, streams.index(name)])  # noqa: E731 - adding an effect changes nothing else
    references = {part: motion.draw(robot, t, random(f"{part} motion"), speed=speed, band=band) for part in ("train", "test")}
    rigid = {part: inverse_dynamics(robot, robot.prior, r.q, r.qd, r.qdd) for part, r in references.items()}
    masses = {part: drawn.mass_matrices(robot, r.q[:: control.STRIDE]) for part, r in references.items()}
    scales, armature = drawn.measured(robot, references["train"], rigid["train"], masses["train"], random("friction"), duration)
    truth = Truth(drawn.true_bodies(robot, random("bodies")), np.array(robot.gravity), scales.viscous, scales.coulomb, armature)
    rng = random("hidden")
    named = [settled(h, robot, scales, rng) for h in named]
    std = drawn.noise_std(scales, random("friction"), noise)
    steps = drawn.encoder_steps(robot, encoder)
    logs, bursts = {}, {}
    for part, reference in references.items():
        bursts[part] = drawn.draw_bursts(named, random("bursts"), part, duration)
        inside = [*parts.build(robot, named, bursts[part]), *(parts.Custom(robot, -1, torque=f) for f in custom)]
        known = np.tanh(reference.qd / (_SOFT_SPEED * scales.speed))
        ahead = rigid[part] + control.KNOWN * (armature * reference.qdd + scales.coulomb * known + scales.viscous * reference.qd)
        loop = control.Loop(reference, ahead, masses[part] + control.KNOWN * np.diag(armature), control.STIFF * scales.torque / scales.reach, period)
        report = (lambda done, part=part: progress(part, done)) if progress else None
        logs[part] = _log(robot, truth, inside, loop, steps, keep, std, colour, share, random(f"{part} noise"), report)
    return Simulation(robot, logs["train"], logs["test"], drawn.document(
        robot, truth, scales, named, custom, logs, bursts, std, steps,
        {"seed": seed, "duration": duration, "rate": rate, "control_period": period, "colour": colour, "coloured_share": share if colour else 0.0},
    ))  # fmt: skip


def _check(duration, rate, noise, colour, share, encoder, speed, band) -> None:
    """Numbers that a simulation can have."""
    within = lambda x, low, high: x is None or (math.isfinite(x) and low <= x <= high)  # noqa: E731
    for option, value, low, high, unit in (
        ("--duration", duration, 1.0, 3600.0, "s"), ("--rate", rate, 20.0, 10000.0, "Hz"), ("--noise", noise, 0.0, 1e6, "N m"),
        ("--colour", colour, 1e-4, 1e3, "s"), ("--encoder", encoder, 0, 40, "bits"), ("--speed", speed, 0.01, 100.0, "rad/s"),
        ("share", share, 0.0, 1.0, "of the variance"),
    ):  # fmt: skip
        if not within(value, low, high):
            raise SysidError(f"{option} {value:g}", allowed=f"{low:g} to {high:g} {unit}")
    if band is not None and not 0.0 < band[0] < band[1] <= 50.0:
        raise SysidError(f"band {band}", allowed="two frequencies [Hz], the lower one first, up to 50")


def _check_hidden(named: list[Hidden], custom: list, robot: Robot) -> None:
    for hide in named:
        check(hide, robot)
        if sum((h.effect, h.joint) == (hide.effect, hide.joint) for h in named) > 1:
            raise SysidError(f"{hide.effect}:{hide.joint} is hidden twice", where="--hide", do="give it once")
    loose = [h.joint for h in named if h.effect in ("elasticity", "backlash")]
    if len(set(loose)) < len(loose):
        raise SysidError("elasticity and backlash on one joint", where="--hide", allowed="one of them a joint")
    if strangers := [f for f in custom if not callable(f)]:
        raise SysidError(f"cannot hide {strangers[0]!r}", allowed="Hidden, or a function of (q, qd, qdd, t, load, memory)")


def _log(robot, truth, inside, loop: control.Loop, steps, keep, std, colour, share, rng, report) -> SimulatedLog:
    plant = Plant(robot, truth, inside, loop.reference.q[0])
    x, v, tau, read, sticks = control.run(plant, inside, loop, steps, report)
    sensed = tau.copy()
    for part in inside:
        if part.has("sense"):
            sensed[:, part.j] = part.sense(sensed[:, part.j], loop.period)
    t = loop.reference.t
    rows = np.flatnonzero(t > -0.5 * loop.period)[::keep]
    q, dof, motor = read[rows], robot.dof, plant.motor
    clean = Clean(x[rows][:, motor], v[rows][:, motor], x[rows, :dof], v[rows, :dof], tau[rows], sensed[rows], sticks[rows])
    added = std * _unitnoise_std(rng, len(rows), dof, keep * loop.period, colour, share)
    with np.errstate(divide="ignore"):
        digit = np.where(std > 0.0, 10.0 ** np.floor(np.log10(np.maximum(std, 1e-300) / 10.0)), 0.0)
    logged = clean.sensed + added
    logged = np.where(digit > 0.0, np.round(logged / np.where(digit > 0.0, digit, 1.0)) * digit, logged)
    rms = np.sqrt(np.mean((logged - clean.sensed) ** 2, axis=0))
    return SimulatedLog(np.round(t[rows] - t[rows[0]], 9), q, logged, clean, rms)


def _unitnoise_std(rng, n: int, dof: int, step: float, colour: float | None, share: float) -> np.ndarray:
    white = rng.standard_normal((n, dof))
    if not colour:
        return white
    from scipy.signal import lfilter

    keep = math.exp(-step / colour)
    drive = math.sqrt(1.0 - keep**2) * rng.standard_normal((n, dof))
    drive[0] /= math.sqrt(1.0 - keep**2)
    return math.sqrt(1.0 - share) * white + math.sqrt(share) * lfilter([1.0], [1.0, -keep], drive, axis=0)


assert set(parts.PARTS) == set(CATALOGUE)
