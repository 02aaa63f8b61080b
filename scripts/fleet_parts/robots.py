"""Simulated robots of one type with drawn differences, written as experiment folders.

Each robot has bodies of its own (the URDF's moved in log-Cholesky coordinates), friction of its own
on every joint, moves on a Fourier series of its own, and its torque carries noise half of which is
coloured; its encoders round. Truth is the inverse dynamics of Pinocchio with these bodies.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from sysid import regressor, robot
from sysid.inertia import LogCholesky
from sysid.robot_spec import RobotSpec

UR5 = "example-robot-data://ur_description/urdf/ur5_robot.urdf"
CONFIG = f"robot: {{urdf: '{UR5}'}}\nmodel: {{effects: [viscous, coulomb]}}\n"
RATE, GRAIN = 250.0, 2.0 * np.pi / 2**19  # Hz; rad
TORQUE_NOISE, MEMORY = 0.015, 0.2  # of each joint's RMS torque; s, of half of its variance
# relative spreads from robot to robot
BODIES, FRICTION = 0.03, 0.10


@dataclass(frozen=True)
class Fault:
    """What is wrong with one robot: friction of a joint times `factor`, or a body added to a
    link."""

    robot: int
    joint: int = -1
    factor: float = 1.0
    body: int = -1
    added: np.ndarray | None = None


@dataclass(frozen=True)
class Type:
    """A type of robot: the machine, and the friction (dof,) of a typical one."""

    machine: robot.Robot
    viscous: np.ndarray
    coulomb: np.ndarray


def ur5() -> Type:
    """A UR5 with friction in proportion to its joints' size."""
    machine = robot.load(RobotSpec(urdf=UR5))
    size = np.array([8.0, 8.0, 5.0, 1.5, 1.5, 1.0])
    return Type(machine, size, size)


def payload(mass: float, com, radius: float = 0.03) -> np.ndarray:
    """The ten parameters of a ball about the origin of the frame of its centre."""
    com = np.asarray(com, dtype=float)
    own = 0.4 * mass * radius**2 * np.eye(3) + mass * (com @ com * np.eye(3) - np.outer(com, com))
    xx, yy, zz, xy, yz, xz = own[0, 0], own[1, 1], own[2, 2], own[0, 1], own[1, 2], own[0, 2]
    return np.array([mass, *(mass * com), xx, yy, zz, xy, yz, xz])


@dataclass(frozen=True)
class Drawn:
    """One robot: bodies (bodies, 10), viscous and coulomb (dof,)."""

    pi: np.ndarray
    viscous: np.ndarray
    coulomb: np.ndarray


def drawn(kind: Type, rng: np.random.Generator) -> Drawn:
    """A robot of a type, without a fault."""
    machine = kind.machine
    theta = BODIES * rng.standard_normal((len(machine.bodies), 10))
    theta[:, 7:] *= 0.1  # m: log-Cholesky moves the centre of mass by lengths
    pi = LogCholesky(machine.prior).parameters(theta)
    own = 1.0 + FRICTION * rng.standard_normal((2, machine.dof))
    return Drawn(pi, own[0] * kind.viscous, own[1] * kind.coulomb)


def with_fault(one: Drawn, fault: Fault) -> Drawn:
    """The same robot with a fault."""
    pi, viscous, coulomb = one.pi.copy(), one.viscous.copy(), one.coulomb.copy()
    if fault.body >= 0:
        pi[fault.body] += fault.added
    if fault.joint >= 0:
        viscous[fault.joint] *= fault.factor
        coulomb[fault.joint] *= fault.factor
    return Drawn(pi, viscous, coulomb)


def moved(rng: np.random.Generator, seconds: float, dof: int, rate: float = RATE):
    """t, q, qd, qdd of five sines a joint."""
    t = np.arange(int(seconds * rate)) / rate
    w = 2.0 * np.pi * rng.uniform(0.1, 0.8, (5, 1, dof))
    a, p = rng.uniform(0.1, 0.5, (5, 1, dof)), rng.uniform(0.0, 2.0 * np.pi, (5, 1, dof))
    phase = w * t[None, :, None] + p
    q, qd, qdd = a * np.sin(phase), a * w * np.cos(phase), -a * w**2 * np.sin(phase)
    return t, q.sum(0), qd.sum(0), qdd.sum(0)


def coloured(rng, shape, step: float, memory: float = MEMORY) -> np.ndarray:
    """Noise of unit variance, half of it white, half with a memory [s]."""
    from scipy.signal import lfilter

    pole = np.exp(-step / memory)
    white = rng.standard_normal((shape[0] + int(10 * memory / step), shape[1]))
    slow = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], white, axis=0)[-shape[0] :]
    return np.sqrt(0.5) * (slow + rng.standard_normal(shape))


def logged(
    kind: Type,
    one: Drawn,
    rng: np.random.Generator,
    seconds: float,
    *,
    rate: float = RATE,
    bias=0.0,
    noise=None,
) -> pl.DataFrame:
    """A log of a robot. bias: (dof,) of its torque [N m]; noise: (dof,) its standard deviation
    [N m], by default a share of what this log's motion needs."""
    machine = kind.machine
    t, q, qd, qdd = moved(rng, seconds, machine.dof, rate)
    tau = regressor.torque(machine, one.pi, q, qd, qdd)
    tau = tau + one.viscous * qd + one.coulomb * np.sign(qd) + bias
    noise = TORQUE_NOISE * np.sqrt(np.mean(tau**2, axis=0)) if noise is None else noise
    tau = tau + noise * coloured(rng, tau.shape, 1 / rate)
    q = np.round(q / GRAIN) * GRAIN
    columns = {"t": t}
    columns |= {f"q_{joint}": q[:, j] for j, joint in enumerate(machine.joints)}
    columns |= {f"tau_{joint}": tau[:, j] for j, joint in enumerate(machine.joints)}
    return pl.DataFrame(columns)


def written(
    folder: Path,
    kind: Type,
    count: int,
    seed: int,
    faults=(),
    *,
    train: float = 20.0,
    test: float = 10.0,
) -> list[Path]:
    """Folders of a fleet's experiments, r00, r01, ...; what is there is not drawn again."""
    made = []
    for k in range(count):
        rng, own = np.random.default_rng([seed, k]), folder / f"r{k:02d}"
        one = drawn(kind, rng)
        for fault in faults:
            one = with_fault(one, fault) if fault.robot == k else one
        own.mkdir(parents=True, exist_ok=True)
        for part, seconds in (("train", train), ("test", test)):
            logged(kind, one, rng, seconds).write_csv(own / f"{part}.csv")
        (own / "config.yaml").write_text(CONFIG)
        made.append(own)
    return made
