"""Closed loop in time: the controller and its encoder, the true robot, the torque sensor; once for each log.

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
from . import control, disturbances, motions, nuisances, parts
from . import truth as drawn
from .hidden import Hidden, check, settled
from .nuisances import Nuisances
from .plant import Plant, Truth
from .simulated import Clean, SimulatedLog, Simulation
from .trajectory import Played
from .usual_sizes import CATALOGUE, Scales

USUAL = 20.0  # s of the motion that says what a robot's joints are like, where its logs are poor or short
LEAD = 1.0  # s before logging starts: a robot at rest has no friction law
_PERIOD = 1e-3  # s of the controller, at most
_SOFT_SPEED = 0.05  # of the top speed, where the friction that the controller expects changes sign


def simulate(
    robot: Robot, *, hide: Sequence[Hidden | Callable] = (), seed: int = 0, duration: float = 20.0, rate: float = 1000.0,
    noise: float | None = None, colour: float | None = None, share: float = 0.5, encoder: int | None = None,
    speed: float | None = None, band: tuple[float, float] | None = None, progress: Callable[[str, float], None] | None = None,
    motion: str = "exciting", logs: int = 1, knocks: int = 0, spikes: float = 0.0, brakes: bool = False, jitter: float = 0.0,
    current: float | str | None = None, trajectory: Played | None = None,
) -> Simulation:  # fmt: skip
    """Simulate training logs and a test log. Everything follows from the arguments.

    Args:
        robot: its prior is what the controller believes; the truth is drawn about it.
        hide: effects, or functions torque(q, qd, qdd, t, load, memory) -> (dof,) [N m] to overcome, which are called once
            a control period; `memory` is a dict of their own in each log.
        seed: of everything random. duration [s] of each log; rate [Hz] of logging.
        noise: standard deviation of the torque noise [N m]; None: 1 to 2 % of each joint's rms torque.
        colour: time constant [s] of the coloured `share` of its variance; None: white.
        encoder: bits a turn of the motor, or of the joint where it has no rotor (a metre of a prismatic joint); 0: exact;
            None: 14 on the motor, behind a gear of 100 where it has no rotor.
        speed: top speed [rad/s]; band: lowest and highest line [Hz] of the exciting motion; None: by the robot's size.
        motion: exciting, moves (from point to point, with stops) or sines (one slow sine a joint).
        logs: number of training logs.
        knocks: on a link, in each log. spikes: wrong samples of the torque [1/s], on each joint.
        brakes: joints that rest are braked: their torque reads nothing then, and their angle stands still.
        jitter: standard deviation [ms] of the instants at which the logger samples.
        current: step [N m] that the logged torque comes in, or a share of each joint's peak torque, as in "2%".
        trajectory: a motion for the first training log to play in place of a drawn one; the robot is the one that is
            drawn without it.

    Raises:
        SysidError: an argument that cannot be, or a robot that does not follow its reference.
    """
    _check(duration, rate, noise, colour, share, encoder, speed, band)
    nuisance = nuisances.checked(motion, logs, rate, knocks, spikes, brakes, jitter, current)
    named, custom = [h for h in hide if isinstance(h, Hidden)], [h for h in hide if not isinstance(h, Hidden)]
    _check_hidden(named, custom, robot)
    keep = math.ceil(1.0 / (rate * _PERIOD) - 1e-9)
    period = 1.0 / (rate * keep)
    times = lambda seconds: period * np.arange(-math.ceil(LEAD / period / keep) * keep, round(seconds / period) + 1)  # noqa: E731
    random = _random(seed)
    places = {"train": ("train", 0)} if logs == 1 else {f"train_{k + 1}": ("train", k) for k in range(logs)}
    places["test"] = ("test", 0)
    references = {
        name: motions.draw(motion, robot, times(duration), random(f"{part} motion", k), speed=speed, band=band)
        for name, (part, k) in places.items()
    }  # fmt: skip
    rigid = {part: inverse_dynamics(robot, robot.prior, r.q, r.qd, r.qdd) for part, r in references.items()}
    masses = {part: drawn.mass_matrices(robot, r.q[:: control.STRIDE]) for part, r in references.items()}
    if motion == "exciting" and logs == 1:
        usual = references["train"], rigid["train"], masses["train"]
    else:  # a robot is what it is, however poor its logs are
        usual = _usual(robot, times(max(duration, USUAL)), random("usual motion"), speed, band)
    scales, armature = drawn.measured(robot, *usual, random("friction"), duration)
    truth = Truth(drawn.true_bodies(robot, random("bodies")), np.array(robot.gravity), scales.viscous, scales.coulomb, armature)
    rng = random("hidden")
    named = [settled(h, robot, scales, rng) for h in named]
    truth = drawn.rubbing(truth, robot, named)
    std = drawn.noise_std(scales, random("friction"), noise)
    steps = drawn.encoder_steps(robot, encoder)
    sensor = _Sensor(scales, steps, keep, std, colour, share, nuisance)
    if trajectory is not None:
        first = next(iter(places))
        references[first] = trajectory.reference(times(trajectory.duration))
        r = references[first]
        rigid[first] = inverse_dynamics(robot, robot.prior, r.q, r.qd, r.qdd)
        masses[first] = drawn.mass_matrices(robot, r.q[:: control.STRIDE])
    found, bursts = {}, {}
    for name, (part, k) in places.items():
        reference, events = references[name], random(f"{part} events", k)
        bursts[name] = drawn.draw_bursts(named, random("bursts"), 1 if part == "test" else k + (k > 0), duration)
        inside = [*parts.build(robot, named, bursts[name]), *(parts.Custom(robot, -1, torque=f) for f in custom)]
        closed = disturbances.closed_at(reference, period) if brakes else None
        if closed is not None:
            inside.append(disturbances.brakes(robot, closed, reference.t[0], period, scales))
        if knocks:
            pulses = disturbances.draw_knocks(knocks, robot, reference, scales, events)
            inside.append(disturbances.Knocks(robot, -1, pulses=pulses))
        known = np.tanh(reference.qd / (_SOFT_SPEED * scales.speed))
        ahead = rigid[name] + control.KNOWN * (armature * reference.qdd + scales.coulomb * known + scales.viscous * reference.qd)
        stiffness = control.STIFF * scales.torque / scales.reach
        loop = control.Loop(reference, ahead, masses[name] + control.KNOWN * np.diag(armature), stiffness, period, closed, parts.limits(inside, robot.dof))
        report = (lambda done, name=name: progress(name, done)) if progress else None
        found[name] = _log(robot, truth, inside, loop, sensor, random(f"{part} noise", k), events, report)
    return Simulation(robot, found, drawn.document(robot, truth, scales, named, custom, found, bursts, std, steps, {
        "seed": seed, "duration": duration, "rate": rate, "control_period": period, "colour": colour, "coloured_share": share if colour else 0.0,
        "motion": motion, "knocks": knocks, "spikes": spikes, "brakes": brakes, "jitter": jitter, "current": current,
    }))  # fmt: skip


def _random(seed: int) -> Callable[..., np.random.Generator]:
    """A generator for everything that is drawn, by its name and the number of the log: adding an effect changes nothing else."""
    streams = (
        "bodies", "friction", "hidden", "train motion", "train noise", "test motion", "test noise", "bursts",
        "usual motion", "train events", "test events",
    )  # fmt: skip
    return lambda name, k=0: np.random.default_rng([seed, streams.index(name), *([k] if k else [])])


def _usual(robot: Robot, t, rng, speed, band):
    """The motion that a robot of this size makes, the torque of its prior and mass matrices."""
    r = motions.draw("exciting", robot, t, rng, speed=speed, band=band)
    return r, inverse_dynamics(robot, robot.prior, r.q, r.qd, r.qdd), drawn.mass_matrices(robot, r.q[:: control.STRIDE])


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


@dataclass(frozen=True)
class _Sensor:
    """What logs: `steps` (dof,) of the encoders, one of every `keep` control periods, torque noise of deviation `std` (dof,) [N m]
    with a coloured `share` [s], and what else is in the logs."""

    scales: Scales
    steps: np.ndarray
    keep: int
    std: np.ndarray
    colour: float | None
    share: float
    nuisance: Nuisances


def _log(robot, truth, inside, loop: control.Loop, sensor: _Sensor, rng, events, report) -> SimulatedLog:
    plant = Plant(robot, truth, inside, loop.reference.q[0])
    x, v, tau, read, sticks = control.run(plant, inside, loop, sensor.steps, report)
    sensed = tau.copy()
    for part in inside:
        if part.has("sense"):
            sensed[:, part.j] = part.sense(sensed[:, part.j], loop.period)
    t, std, nuisance = loop.reference.t, sensor.std, sensor.nuisance
    rows = np.flatnonzero(t > -0.5 * loop.period)[:: sensor.keep]
    stamps = np.round(t[rows] - t[rows[0]], 9)
    if nuisance.jitter:
        rows, stamps = nuisances.jittered(rows, t, sensor.keep, loop.period, nuisance.jitter, events)
    q, dof, motor = read[rows], robot.dof, plant.motor
    exact = x[:, motor].copy()
    for part in inside:
        if part.has("read"):
            exact[:, part.j] = [part.read(float(angle)) for angle in exact[:, part.j]]
    found = sensed[rows]  # a slow logger's values are older than its stamps
    at = (lambda values: values[rows]) if not nuisance.jitter else lambda values: nuisances.interpolated(t, values, stamps)
    clean = Clean(at(x[:, motor]), at(v[:, motor]), at(x[:, :dof]), at(v[:, :dof]), at(tau), at(sensed), sticks[rows], at(exact))
    added = std * _unitnoise_std(rng, len(rows), dof, sensor.keep * loop.period, sensor.colour, sensor.share)
    with np.errstate(divide="ignore"):
        digit = np.where(std > 0.0, 10.0 ** np.floor(np.log10(np.maximum(std, 1e-300) / 10.0)), 0.0)
    coarse = nuisance.steps(sensor.scales)
    digit = digit if coarse is None else coarse
    rounded = lambda tau: np.where(digit > 0.0, np.round(tau / np.where(digit > 0.0, digit, 1.0)) * digit, tau)  # noqa: E731
    noisy = found + added
    logged = rounded(noisy)
    told = [event for part in inside if isinstance(part, disturbances.Knocks) for event in part.events(robot, std)]
    rms = np.sqrt(np.mean((logged - found) ** 2, axis=0))
    if nuisance.spikes:
        wrong, spikes = nuisances.spiked(noisy, stamps, nuisance.spikes, nuisances.spike_scale(std, sensor.scales), events)
        logged, told = rounded(wrong), told + spikes
    if loop.closed is not None:
        away, braked = nuisances.braked(loop.closed, sticks, rows, stamps)
        logged = np.where(away, 0.0, logged)
        told = [e for e in told if e["kind"] != "spike" or not away[slice(*e["rows"]), e["joints"][0]].all()] + braked
        # of a joint whose brake is closed throughout nothing is noisy
        rms = np.sqrt(np.sum((rounded(noisy) - found) ** 2, axis=0, where=~away) / np.maximum(np.sum(~away, axis=0), 1))
    named = tuple({**event, "joints": [robot.joints[j] for j in event["joints"]]} for event in sorted(told, key=lambda e: e["start"]))
    return SimulatedLog(stamps, q, logged, clean, rms, named)


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
