"""Servo arms in MuJoCo: no torque is logged, only a commanded position and what the joint did."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np


@dataclass(frozen=True)
class Servos:
    """What is true of an arm's drives: each (dof,), delay in samples of the log."""

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


def commands(rng, seconds: float, rate: float, dof: int) -> tuple[np.ndarray, np.ndarray]:
    """t (n,), commands (n, dof): sums of sines that come up from rest."""
    t = np.arange(0.0, seconds, 1.0 / rate)
    q = np.zeros((len(t), dof))
    for j in range(dof):
        for f in rng.uniform(0.2, 2.5, 6):
            q[:, j] += rng.uniform(0.1, 0.35) / (1.0 + f) * np.sin(2.0 * np.pi * f * t + rng.uniform(0.0, 6.0))
    return t, q * np.minimum(t, 1.0)[:, None]


def run(urdf: str, servos: Servos, rng, seconds: float = 12.0, rate: float = 500.0, noise: float = 1e-4, fine: int = 10, springs=()):
    """t, commands and angles as logged (n, dof); springs: (joint, N m/rad) that the arm has beside its drives."""
    spec = mujoco.MjSpec.from_string(urdf)
    spec.option.timestep, spec.option.integrator = 1.0 / rate / fine, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    model = spec.compile()
    dof = model.nv
    model.dof_armature[:], model.dof_damping[:], model.dof_frictionloss[:] = servos.armature, servos.viscous + servos.kd, servos.coulomb
    model.dof_solref[:, 0] = 2.0 * model.opt.timestep  # friction as stiff as the step allows
    for joint, stiffness in springs:
        model.jnt_stiffness[joint] = stiffness
    data = mujoco.MjData(model)
    t, asked = commands(rng, seconds, rate, dof)
    out = np.zeros_like(asked)
    for k in range(len(t)):
        out[k] = data.qpos
        acts = asked[max(k - servos.delay, 0)]
        for _ in range(fine):
            data.qfrc_applied[:] = servos.kp * (acts - data.qpos)
            mujoco.mj_step(model, data)
    return t, asked, out + noise * rng.normal(size=out.shape)


def write(folder: Path, seed: int, dof: int, config: str, **options) -> Servos:
    """An arm with training and test logs and its experiment file in a folder; what is true of its drives."""
    rng = np.random.default_rng(seed)
    urdf, servos = arm_urdf(rng, dof), draw(rng, dof)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.urdf").write_text(urdf)
    for part in ("train", "test"):
        t, asked, q = run(urdf, servos, rng, **options)
        names = ["t"] + [f"{kind}_joint_{j + 1}" for kind in ("q", "cmd") for j in range(dof)]
        np.savetxt(folder / f"{part}.csv", np.column_stack([t, q, asked]), delimiter=",", header=",".join(names), comments="")
    (folder / "config.yaml").write_text(config)
    return servos
