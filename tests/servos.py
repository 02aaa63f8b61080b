"""Servo arms in MuJoCo: no torque is logged, only a commanded position and what the joint did."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

TICK = 0.002  # s, in which delays are counted


@dataclass(frozen=True)
class Servos:
    """What is true of an arm's drives: each (dof,), delay in ticks of 2 ms."""

    kp: np.ndarray
    kd: np.ndarray
    armature: np.ndarray
    viscous: np.ndarray
    coulomb: np.ndarray
    delay: int


def arm_urdf(rng, dof: int) -> str:
    """An arm of thin boxes, axes y and x in turn after a first that may stand."""
    links, joints, last = ['<link name="base"/>'], [], 0.0
    for k in range(dof):
        length, mass = rng.uniform(0.12, 0.25), rng.uniform(0.15, 0.5) * (dof - k) ** 0.5
        x, y, z = (mass * np.array([0.03**2 + length**2, 0.03**2 + length**2, 2 * 0.03**2]) / 12).tolist()
        links.append(
            f'<link name="link_{k + 1}"><inertial><origin xyz="0.01 0.005 {length / 2}"/><mass value="{mass}"/>'
            f'<inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        )
        axis = "0 1 0" if k % 2 == 0 else "1 0 0"
        parent, at = ("base" if k == 0 else f"link_{k}"), last
        joints.append(
            f'<joint name="joint_{k + 1}" type="revolute"><parent link="{parent}"/><child link="link_{k + 1}"/><origin xyz="0 0 {at}"/>'
            f'<axis xyz="{axis}"/><limit lower="-3" upper="3" effort="50" velocity="20"/></joint>'
        )
        last = length
    return f'<robot name="servos">{"".join(links)}{"".join(joints)}</robot>'


def draw(rng, dof: int) -> Servos:
    """Drives as hobby servos have: stiff enough to hold the arm, with a motor's inertia like a link's."""
    reach = np.arange(dof, 0, -1)
    return Servos(
        kp=rng.uniform(15.0, 40.0, dof) * reach**0.5, kd=rng.uniform(0.3, 1.0, dof), armature=rng.uniform(0.004, 0.02, dof),
        viscous=rng.uniform(0.02, 0.1, dof), coulomb=rng.uniform(0.02, 0.1, dof), delay=int(rng.integers(2, 9)),
    )  # fmt: skip


def commands(rng, seconds: float, period: float, dof: int, jerk: float = 0.0) -> np.ndarray:
    """Commands (n, dof), one a period [s]: sums of sines that come up from rest; `jerk`: the deviation [rad] of a
    random step that each takes on top, as a policy's do."""
    t = np.arange(0.0, seconds, period)
    q = np.zeros((len(t), dof))
    for j in range(dof):
        for f in rng.uniform(0.2, 2.5, 6):
            q[:, j] += rng.uniform(0.1, 0.35) / (1.0 + f) * np.sin(2.0 * np.pi * f * t + rng.uniform(0.0, 6.0))
    if jerk:
        q += rng.normal(0.0, jerk, q.shape)
    return q * np.minimum(t, 1.0)[:, None]


def compiled(urdf: str | mujoco.MjSpec, servos: Servos, step: float, springs=()) -> mujoco.MjModel:
    """An arm in MuJoCo with its drives' inertia, damping and friction, in steps [s]."""
    spec = mujoco.MjSpec.from_string(urdf) if isinstance(urdf, str) else urdf
    spec.option.timestep, spec.option.integrator = step, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    model = spec.compile()
    model.dof_armature[:], model.dof_damping[:], model.dof_frictionloss[:] = servos.armature, servos.viscous + servos.kd, servos.coulomb
    model.dof_solref[:, 0] = 2.0 * step  # friction as stiff as the step allows
    for joint, stiffness in springs:
        model.jnt_stiffness[joint] = stiffness
    return model


def let_go(model: mujoco.MjModel, kp, acting: np.ndarray, fine: int, start=None, limit: float = np.inf) -> np.ndarray:
    """Angles (n, dof) at the beginning of every `fine` steps under commands that act in each step (n fine, dof).

    Args:
        start: (q, qd) of the first; at rest at zero without. limit: most that a servo gives [N m].
    """
    data = mujoco.MjData(model)
    if start is not None:
        data.qpos[:], data.qvel[:] = start
    out = np.zeros((len(acting) // fine, model.nv))
    for k, command in enumerate(acting):
        if k % fine == 0:
            out[k // fine] = data.qpos
        data.qfrc_applied[:] = np.clip(kp * (command - data.qpos), -limit, limit)
        mujoco.mj_step(model, data)
    return out


def run(
    urdf: str, servos: Servos, rng, seconds: float = 12.0, rate: float = 500.0, noise: float = 1e-4, fine: int = 10, springs=(),
    period: float | None = None, jerk: float = 0.0, bits: int | None = None, limit: float = np.inf,
):  # fmt: skip
    """t, commands and angles as logged (n, dof).

    Args:
        fine: steps of MuJoCo in a sample of the log. springs: (joint, N m/rad) that the arm has beside its drives.
        period: how long a command is held [s], a sample by default. bits: of an encoder. limit: of the drives [N m].
    """
    model = compiled(urdf, servos, 1.0 / rate / fine, springs)
    period = 1.0 / rate if period is None else period
    given = commands(rng, seconds, period, model.nv, jerk)
    t = np.arange(0.0, seconds, 1.0 / rate)
    held = lambda at: given[np.clip((at / period + 1e-6).astype(int), 0, len(given) - 1)]  # noqa: E731
    steps = np.arange(len(t) * fine) / rate / fine
    q = let_go(model, servos.kp, held(np.maximum(steps - servos.delay * TICK, 0.0)), fine, limit=limit)
    q = q + noise * rng.normal(size=q.shape)
    if bits is not None:
        q = np.round(q / (2.0 * np.pi) * 2**bits) * 2.0 * np.pi / 2**bits
    return t, held(t), q


def write(folder: Path, seed: int, dof: int, config: str, **options) -> Servos:
    """An arm with training and test logs and its experiment file in a folder; what is true of its drives."""
    rng = np.random.default_rng(seed)
    urdf, servos = arm_urdf(rng, dof), draw(rng, dof)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.urdf").write_text(urdf)
    (folder / "config.yaml").write_text(config)
    for part in ("train", "test"):
        record(folder / f"{part}.csv", *run(urdf, servos, rng, **options))
    return servos


def record(path: Path, t, asked, q) -> None:
    """A log of commands and angles (n, dof) as a CSV."""
    names = ["t"] + [f"{kind}_joint_{j + 1}" for kind in ("q", "cmd") for j in range(q.shape[1])]
    np.savetxt(path, np.column_stack([t, q, asked]), delimiter=",", header=",".join(names), comments="")
