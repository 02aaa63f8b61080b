"""Closed loop in time: the controller and its encoder, the true robot, the torque sensor; twice, for two logs.

Timing. The command computed from the reading at t_k acts from t_k + T/2 to t_k + 3T/2: the encoder is read in the middle of
each hold, as drives that sample in step with their PWM do. Torque and angle logged at t_k then belong to one instant, up
to T^2. T is at most a millisecond; a slower log keeps every so many of its samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..errors import SysidError
from ..inertia import PARAMETERS, LogCholesky
from ..inertia import pseudo as bodies
from ..regressor import torque as inverse_dynamics
from ..robot import Robot
from . import motion, parts
from .hidden import CATALOGUE, Hidden, Scales, check, settled
from .plant import Plant, Truth

LEAD = 1.0  # s before logging starts: a robot at rest has no friction law
_PERIOD = 1e-3  # s of the controller, at most
_BANDWIDTH, _SOFT, _DAMPING = 10.0, 6.0, 0.9  # rad/s of a joint's loop, and of one whose drive is not rigid; its damping
_STIFF = 5.0  # times a joint's torque over its reach: the least stiffness, where a light hand would give way to its weight
_STIFFEST = 3.0  # times the bandwidth that this may come to
_RESET = 0.5  # s of the integral
_SMOOTHING = 10e-3  # s over which the controller's speed is smoothed
_KNOWN, _SOFT_SPEED = 0.8, 0.05  # share of friction and motor inertia that the controller knows; of the top speed, where it changes sign
_STRIDE = 10  # control periods between mass matrices of the controller
_SPREAD = np.array([0.15, 0.15, 0.15, 0.15, 0.10, 0.10, 0.10, 0.01, 0.01, 0.01])  # of bodies in log-Cholesky coordinates; the last three [m]
_FRICTION, _VISCOUS, _ARMATURE, _NOISE = (0.03, 0.08), (0.03, 0.08), (0.2, 0.6), (0.01, 0.02)
_FLOOR_TORQUE, _FLOOR_INERTIA = 0.02, 0.02  # of the largest joint's: a wrist's motor is not as light as its hand
_MOTOR_BITS, _GEAR = 14, 100.0  # of an encoder on the motor; the gear behind a motor that has no rotor in the model
_ASTRAY = 0.35  # of a joint's room and of 0.2 rad: farther from its reference it is out of control


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
    masses = {part: _mass_matrices(robot, r.q[::_STRIDE]) for part, r in references.items()}
    scales, armature = _scales(robot, references["train"], rigid["train"], masses["train"], random("friction"), duration)
    truth = Truth(true_bodies(robot, random("bodies")), np.array(robot.gravity), scales.viscous, scales.coulomb, armature)
    rng = random("hidden")
    named = [settled(h, robot, scales, rng) for h in named]
    std = _noise(scales, random("friction"), noise)
    steps = _encoder_steps(robot, encoder)
    logs, bursts = {}, {}
    for part, reference in references.items():
        bursts[part] = _bursts(named, random("bursts"), part, duration)
        inside = [*parts.build(robot, named, bursts[part]), *(parts.Custom(robot, -1, torque=f) for f in custom)]
        known = np.where(np.abs(reference.qd) > 0.0, np.tanh(reference.qd / (_SOFT_SPEED * scales.speed)), 0.0)
        ahead = rigid[part] + _KNOWN * (armature * reference.qdd + scales.coulomb * known + scales.viscous * reference.qd)
        loop = _Loop(reference, ahead, masses[part] + _KNOWN * np.diag(armature), _STIFF * scales.torque / scales.reach, period)
        report = (lambda done, part=part: progress(part, done)) if progress else None
        logs[part] = _log(robot, truth, inside, loop, steps, keep, std, colour, share, random(f"{part} noise"), report)
    return Simulation(robot, logs["train"], logs["test"], _document(
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


def true_bodies(robot: Robot, rng: np.random.Generator) -> np.ndarray:
    """Bodies (bodies, 10) to be found: the prior moved in log-Cholesky coordinates, so each is possible; rotors stay solids
    of revolution about their axis, as balanced rotors are."""
    theta = _SPREAD * rng.standard_normal(robot.prior.shape)
    theta[:, 7:] *= min(1.0, motion.reach(robot) / 0.3)
    for b, body in enumerate(robot.bodies):
        if body.kind != "rotor":
            continue
        across = np.flatnonzero(np.abs(robot.subspaces[body.row, 3:]) < 1e-9)
        theta[b, 4:7] = 0.0
        theta[b, 7 + across] = 0.0
        if len(across) == 2:
            theta[b, 1 + across] = theta[b, 1 + across[0]]
        else:  # an oblique axis: only its size may change
            theta[b, 1:4] = theta[b, 1]
            theta[b, 7:] = 0.0
    return LogCholesky(robot.prior).parameters(theta)


def _mass_matrices(robot: Robot, q) -> np.ndarray:
    """Mass matrices (n, dof, dof) of the prior at q (n, dof)."""
    data, G = robot.model.createData(), robot.transmission
    return np.array([G.T @ pin.crba(robot.model, data, G @ row) @ G for row in q])


def _scales(robot: Robot, reference, rigid, masses, rng, duration: float) -> tuple[Scales, np.ndarray]:
    """What the joints are like, friction included, and the inertia (dof,) of motors without a rotor."""
    kinds = [robot.prismatic == kind for kind in (False, True)]
    largest = lambda x, kind: x[kind].max() if kind.any() else 0.0  # noqa: E731
    rms, inertia = np.sqrt(np.mean(rigid**2, axis=0)), masses.diagonal(axis1=1, axis2=2).mean(axis=0)
    for kind in kinds:
        rms[kind] = np.maximum(rms[kind], _FLOOR_TORQUE * largest(rms, kind))
        inertia[kind] = np.maximum(inertia[kind], _FLOOR_INERTIA * largest(inertia, kind))
    speed = np.abs(reference.qd).max(axis=0)
    coulomb = rng.uniform(*_FRICTION, robot.dof) * rms
    viscous = rng.uniform(*_VISCOUS, robot.dof) * rms / speed
    rotors = [body.joint for body in robot.bodies if body.kind == "rotor"]
    bare = np.array([joint not in rotors for joint in robot.joints])
    armature = np.where(bare, rng.uniform(*_ARMATURE, robot.dof) * inertia, 0.0)
    # a force at the hand that its joints can bear
    slides = bool(robot.prismatic.any())
    force = min(3.0 * rms[robot.prismatic].min() if slides else np.inf, np.inf if robot.prismatic.all() else rms[~robot.prismatic].max() / motion.reach(robot))
    peak = np.maximum(np.abs(rigid).max(axis=0), 1.5 * rms)
    middle = 0.5 * (reference.q.max(axis=0) + reference.q.min(axis=0))
    scales = Scales(
        robot.joints, rms, peak, inertia + armature, speed, np.abs(reference.q - middle).max(axis=0), middle, coulomb, viscous,
        float(robot.prior[parts.last_link(robot), 0]), motion.reach(robot), float(force), duration,
    )  # fmt: skip
    return scales, armature


def _noise(scales: Scales, rng, noise: float | None) -> np.ndarray:
    drawn = rng.spawn(1)[0].uniform(*_NOISE, len(scales.joints)) * scales.torque
    return drawn if noise is None else np.full(len(scales.joints), float(noise))


def _encoder_steps(robot: Robot, bits: int | None) -> np.ndarray:
    """Encoder steps (dof,) at the joints [rad or m]; 0 is exact."""
    if bits == 0:
        return np.zeros(robot.dof)
    steps = np.where(robot.prismatic, 1.0, 2.0 * np.pi) / (2.0**_MOTOR_BITS * _GEAR if bits is None else 2.0**bits)
    for body in robot.bodies:
        if body.kind == "rotor":
            j = robot.joints.index(body.joint)
            ratio = abs(robot.transmission[body.row, j])
            if ratio > 0.0:
                steps[j] = 2.0 * np.pi / 2.0 ** (_MOTOR_BITS if bits is None else bits) / ratio
    return steps


def _bursts(named: list[Hidden], rng, part: str, duration: float) -> list[tuple[float, float, np.ndarray]]:
    """Windows and forces of the external force in one log."""
    found = [h for h in named if h.effect == "external_force"]
    if not found:
        return []
    rng = rng.spawn(2)[part == "test"]
    count = max(1, round(float(found[0].values["windows"])))
    starts = duration * (np.arange(count) + rng.uniform(0.1, 0.7, count)) / count
    out = []
    for start in starts:
        direction = rng.normal(size=3)
        force = float(found[0].values["force"]) * rng.uniform(0.7, 1.3) * direction / np.linalg.norm(direction)
        out.append((float(start), float(min(start + rng.uniform(0.3, 0.6), duration)), force))
    return out


@dataclass(frozen=True)
class _Loop:
    """The controller: computed torque `ahead` (n, dof) of the prior along the reference, and a PID law through the prior's
    mass matrices (one every _STRIDE periods), at least `stiffness` (dof,) strong."""

    reference: motion.Reference
    ahead: np.ndarray
    masses: np.ndarray
    stiffness: np.ndarray
    period: float

    def gains(self, plant: Plant) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness and damping matrices (n/_STRIDE, dof, dof)."""
        own = self.masses.diagonal(axis1=1, axis2=2).mean(axis=0)
        omega = np.array([_BANDWIDTH if m == j else _SOFT for j, m in enumerate(plant.motor)])
        more = np.maximum(np.minimum(self.stiffness, (_STIFFEST * omega) ** 2 * own) - omega**2 * own, 0.0)
        kp = self.masses * omega**2 + np.diag(more)
        kd = 2.0 * _DAMPING * (self.masses * omega + np.diag(np.sqrt(more * own)))
        return kp, kd


def _log(robot, truth, inside, loop: _Loop, steps, keep, std, colour, share, rng, report) -> SimulatedLog:
    plant = Plant(robot, truth, inside, loop.reference.q[0])
    x, v, tau, read, sticks = _run(plant, inside, loop, steps, report)
    sensed = tau.copy()
    for part in inside:
        if part.has("sense"):
            sensed[:, part.j] = part.sense(sensed[:, part.j], loop.period)
    t = loop.reference.t
    rows = np.flatnonzero(t > -0.5 * loop.period)[::keep]
    q, dof, motor = read[rows], robot.dof, plant.motor
    clean = Clean(x[rows][:, motor], v[rows][:, motor], x[rows, :dof], v[rows, :dof], tau[rows], sensed[rows], sticks[rows])
    added = std * _unit_noise(rng, len(rows), dof, keep * loop.period, colour, share)
    with np.errstate(divide="ignore"):
        digit = np.where(std > 0.0, 10.0 ** np.floor(np.log10(np.maximum(std, 1e-300) / 10.0)), 0.0)
    logged = clean.sensed + added
    logged = np.where(digit > 0.0, np.round(logged / np.where(digit > 0.0, digit, 1.0)) * digit, logged)
    rms = np.sqrt(np.mean((logged - clean.sensed) ** 2, axis=0))
    return SimulatedLog(np.round(t[rows] - t[rows[0]], 9), q, logged, clean, rms)


def _unit_noise(rng, n: int, dof: int, step: float, colour: float | None, share: float) -> np.ndarray:
    white = rng.standard_normal((n, dof))
    if not colour:
        return white
    from scipy.signal import lfilter

    keep = math.exp(-step / colour)
    drive = math.sqrt(1.0 - keep**2) * rng.standard_normal((n, dof))
    drive[0] /= math.sqrt(1.0 - keep**2)
    return math.sqrt(1.0 - share) * white + math.sqrt(share) * lfilter([1.0], [1.0, -keep], drive, axis=0)


def _run(plant: Plant, inside, loop: _Loop, steps, report):
    """x, v (n, coordinates), torque asked for, readings and sticking (n, dof) at every control period."""
    reference, period = loop.reference, loop.period
    n, dof, motor = len(reference.t), plant.dof, plant.motor
    x, v, tau = np.zeros((n, plant.n)), np.zeros((n, plant.n)), np.zeros((n, dof))
    read, sticks = np.zeros((n, dof)), np.zeros((n, dof), dtype=bool)
    readers = [part for part in inside if part.has("read")]
    fine = np.where(steps > 0.0, steps, 1.0)
    exact = not np.any(steps > 0.0)
    rounded = steps > 0.0
    kp, kd = loop.gains(plant)
    forget = min(1.0, period / _SMOOTHING)
    middle = 0.5 * (reference.q.max(axis=0) + reference.q.min(axis=0))
    room = _ASTRAY * (0.2 + np.abs(reference.q - middle).max(axis=0))

    def look():
        angle = plant.x[motor] if plant.n > dof else plant.x
        if readers:
            angle = angle.copy()
            for part in readers:
                angle[part.j] = part.read(float(angle[part.j]))
        if exact:
            return angle
        return np.where(rounded, np.rint(angle / fine) * fine, angle)

    last, speed, total, command, half = look(), np.zeros(dof), np.zeros(dof), loop.ahead[0], 0.5 * period
    for k in range(n):
        now = look()
        x[k], v[k], tau[k], read[k] = plant.x, plant.v, command, now
        sticks[k] = [s == 0 for s in plant.sign]
        speed = speed + forget * ((now - last) / period - speed)
        last = now
        wrong = reference.q[k] - now
        soon = min(k + 1, n - 1)
        total = total + (period / _RESET) * wrong
        following = loop.ahead[soon] + kp[k // _STRIDE].dot(wrong + total) + kd[k // _STRIDE].dot(reference.qd[k] - speed)
        plant.freeze(reference.t[k] + half, half)
        plant.advance(command, half)
        plant.advance(following, half)
        command = following
        if k % 200 == 0:
            astray = ~(np.abs(wrong) < room)
            if astray.any():
                j = int(np.flatnonzero(astray)[0])
                raise SysidError(
                    f"the simulated joint {j + 1} of {dof} is {abs(wrong[j]):.3g} from its reference at t = {reference.t[k]:.2f} s",
                    allowed=f"{room[j]:.3g}", do="lower --speed, or hide less",
                )  # fmt: skip
            if report is not None:
                report((k + 1) / n)
    return x, v, tau, read, sticks


def _document(robot, truth: Truth, scales: Scales, named, custom, logs, bursts, std, steps, run: dict) -> dict:
    """What truth.json says."""
    joints = robot.joints
    by_joint = lambda values: {joint: float(value) for joint, value in zip(joints, values)}  # noqa: E731
    rms = lambda x: np.sqrt(np.mean(np.square(x), axis=0))  # noqa: E731
    gravity = truth.gravity
    for part in parts.build(robot, [h for h in named if h.effect == "gravity_tilt"], []):
        gravity = part.truth(truth).gravity
    hidden = [{"effect": h.effect, "joint": h.joint, "values": dict(h.values)} for h in named]
    for entry in hidden:
        if entry["effect"] == "cogging":  # the same as the sum of a sine and a cosine
            a, phase = entry["values"]["a"], entry["values"]["phase"]
            entry["values"] |= {"a1": a * math.cos(phase), "b1": a * math.sin(phase)}
        if entry["effect"] == "encoder_eccentricity":
            d, phi = entry["values"]["d"], entry["values"]["phi"]
            entry["values"] |= {"s": d * math.cos(phi), "c": d * math.sin(phi)}
        if entry["effect"] == "warmup":
            a, j = entry["values"]["a"], joints.index(entry["joint"])
            entry["values"] |= {"dFv": a * float(truth.viscous[j]), "dFc": a * float(truth.coulomb[j])}
        if entry["effect"] == "spring":
            entry["values"]["c"] = -entry["values"]["k"] * entry["values"]["q0"]
        if entry["effect"] == "external_force":
            entry["bursts"] = {
                part: [{"start": start, "stop": stop, "force": force.tolist()} for start, stop, force in windows] for part, windows in bursts.items()
            }
            entry["body"] = robot.bodies[parts.last_link(robot)].name
        if entry["effect"] == "payload":
            entry["body"] = robot.bodies[parts.last_link(robot)].name
            v = entry["values"]
            entry["inertia"] = bodies.box(v["m"], [v[key] for key in "xyz"], [v[f"l{key}"] for key in "xyz"]).tolist()
    hidden += [{"effect": "custom", "joint": "*", "name": getattr(f, "__name__", type(f).__name__)} for f in custom]
    return {
        "simulated_by": "sysid simulate", "run": run, "joints": list(joints), "parameters": list(PARAMETERS),
        "inertias": {body.name: pi.tolist() for body, pi in zip(robot.bodies, truth.pi)},
        "friction": {joint: {"Fv": float(truth.viscous[j]), "Fc": float(truth.coulomb[j])} for j, joint in enumerate(joints)},
        "armature": {joint: float(ia) for joint, ia in zip(joints, truth.armature) if ia > 0.0},
        "gravity": gravity.tolist(), "hidden": hidden,
        "torque_noise_std": by_joint(std), "encoder_step": by_joint(steps),
        "logs": {
            part: {
                "samples": len(log.t), "noise_rms": by_joint(log.noise), "torque_rms": by_joint(rms(log.clean.tau)),
                "top_speed": by_joint(np.abs(log.clean.qd).max(axis=0)), "sticking": by_joint(log.clean.sticks.mean(axis=0)),
            }
            for part, log in logs.items()
        },
        "scales": {"torque": by_joint(scales.torque), "inertia": by_joint(scales.inertia), "speed": by_joint(scales.speed)},
    }  # fmt: skip


assert set(parts.PARTS) == set(CATALOGUE)
