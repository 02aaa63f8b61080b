"""What is drawn to be true of a simulated robot, and truth.json, which says all of it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin

from ..effect import last_link
from ..inertia import PARAMETERS, LogCholesky
from ..inertia import pseudo as bodies
from ..robot import Robot
from . import motion, parts
from .hidden import Hidden
from .plant import Truth
from .usual_sizes import Scales

_SPREAD = np.array([0.15, 0.15, 0.15, 0.15, 0.10, 0.10, 0.10, 0.01, 0.01, 0.01])  # of bodies in log-Cholesky coordinates; the last three [m]
_FRICTION, _VISCOUS, _NOISE = (0.03, 0.08), (0.03, 0.08), (0.01, 0.02)  # of a joint's rms torque; viscous at its top speed
_ARMATURE = (0.2, 0.6)  # of a joint's typical inertia
_FLOOR_TORQUE, _FLOOR_INERTIA = 0.02, 0.02  # of the largest joint's: a wrist's motor is not as light as its hand
_TURN = 4097  # angles of a turn
_MOTOR_BITS, _GEAR = 14, 100.0  # of an encoder on the motor; the gear behind a motor that has no rotor in the model


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


def mass_matrices(robot: Robot, q) -> np.ndarray:
    """Mass matrices (n, dof, dof) of the prior at q (n, dof)."""
    data, G = robot.model.createData(), robot.transmission
    return np.array([G.T @ pin.crba(robot.model, data, G @ row) @ G for row in q])


def measured(robot: Robot, reference, rigid, masses, rng, duration: float) -> tuple[Scales, np.ndarray]:
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
        float(robot.prior[last_link(robot), 0]), motion.reach(robot), float(force), duration,
    )  # fmt: skip
    return scales, armature


def noise_std(scales: Scales, rng, noise: float | None) -> np.ndarray:
    """Standard deviation (dof,) of the torque noise: given, or drawn."""
    drawn = rng.spawn(1)[0].uniform(*_NOISE, len(scales.joints)) * scales.torque
    return drawn if noise is None else np.full(len(scales.joints), float(noise))


def encoder_steps(robot: Robot, bits: int | None) -> np.ndarray:
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


def rubbing(truth: Truth, robot, named: list[Hidden]) -> Truth:
    """The truth with so much Coulomb friction that what changes with a joint's angle is friction at every angle of a turn."""
    coulomb, q = truth.coulomb.copy(), np.linspace(0.0, 2.0 * np.pi, _TURN)
    for hide in named:
        if hide.effect == "position_friction":
            waves = [value * (np.cos if name[0] == "a" else np.sin)(int(name[1:]) * q) for name, value in hide.values.items()]
            j = robot.joints.index(hide.joint)
            coulomb[j] = max(coulomb[j], -float(np.sum(waves, axis=0).min()))
    return replace(truth, coulomb=coulomb)


def draw_bursts(named: list[Hidden], rng, place: int, duration: float) -> list[tuple[float, float, np.ndarray]]:
    """Windows and forces of the external force in one log, by the log's place."""
    found = [h for h in named if h.effect == "external_force"]
    if not found:
        return []
    rng = rng.spawn(place + 1)[place]
    count = max(1, round(float(found[0].values["windows"])))
    starts = duration * (np.arange(count) + rng.uniform(0.1, 0.7, count)) / count
    out = []
    for start in starts:
        direction = rng.normal(size=3)
        force = float(found[0].values["force"]) * rng.uniform(0.7, 1.3) * direction / np.linalg.norm(direction)
        out.append((float(start), float(min(start + rng.uniform(0.3, 0.6), duration)), force))
    return out


def document(robot, truth: Truth, scales: Scales, named, custom, logs, bursts, std, steps, run: dict) -> dict:
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
            entry["body"] = robot.bodies[last_link(robot)].name
        if entry["effect"] == "payload":
            entry["body"] = robot.bodies[last_link(robot)].name
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
                "events": list(log.events),
            }
            for part, log in logs.items()
        },
        "scales": {"torque": by_joint(scales.torque), "inertia": by_joint(scales.inertia), "speed": by_joint(scales.speed)},
    }  # fmt: skip

