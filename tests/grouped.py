"""An experiment whose logs are of two robots with four payloads, the empty arm among them, for
tests. The truth is Pinocchio's: a payload is a body appended to the last link of its model."""

import numpy as np
import pinocchio as pin

from sysid import config, pipeline
from sysid.inertia import LogCholesky
from tests.conftest import csv, dump
from tests.conftest import motion as swing

MASS = {"none": 0.0, "one": 0.6, "two": 1.2, "three": 2.0}  # kg
COM = (0.02, -0.03, -0.15)
ROUGH = 1.5  # of the friction of robot r2
NOISE, RATE, SECONDS = 0.05, 200.0, 12.0
JOINTS = ("shoulder", "wrist", "elbow")
SPATIAL = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="1.5"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.021" iyz="0" izz="0.003"/>
  </inertial></link>
  <link name="middle"><inertial><origin xyz="0.02 0 -0.1"/><mass value="0.9"/>
    <inertia ixx="0.006" ixy="0" ixz="0" iyy="0.005" iyz="0" izz="0.002"/>
  </inertial></link>
  <link name="lower"><inertial><origin xyz="0 0 -0.15"/><mass value="0.8"/>
    <inertia ixx="0.007" ixy="0" ixz="0" iyy="0.0072" iyz="0" izz="0.001"/>
  </inertial></link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><origin xyz="0 0 1"/><axis xyz="0.6 0.8 0"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/>
  </joint>
  <joint name="wrist" type="revolute">
    <parent link="upper"/><child link="middle"/><origin xyz="0 0 -0.4"/><axis xyz="1 0 0"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="middle"/><child link="lower"/><origin xyz="0 0 -0.4"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="50" velocity="10"/>
  </joint>
</robot>
"""
PER_PAYLOAD = [
    {"viscous": {"per": "robot"}},
    "coulomb",
    {"payload": {"per": "payload", "except": ["none"]}},
]


def tree(effects=PER_PAYLOAD, **changes) -> dict:
    """The experiment of eight logs: every payload on both robots, held-out logs of each."""
    groups = {
        "payload": {level: [f"{level}_*.csv"] for level in MASS},
        "robot": {
            "r1": ["none_train.csv", "none_test.csv", "two_*.csv"],
            "r2": ["one_*.csv", "three_*.csv"],
        },
    }
    train, test = ([f"{level}_{part}.csv" for level in MASS] for part in ("train", "test"))
    own = {
        "robot": {"urdf": "robot.urdf"},
        "data": {"train": train, "test": test, "groups": groups},
        "preprocess": {"standstill": "keep"},
        "model": {"effects": effects},
        "prior": {"weight": 1e-3},
    }
    return {**own, **changes}


def waved(seed: int, seconds: float):
    """t, q, qd, qdd of three joints."""
    t = np.arange(int(seconds * RATE)) / RATE
    first, second = swing(t, seed), swing(t, seed + 500)
    return t, *(np.column_stack([a, b[:, 0]]) for a, b in zip(first, second))


def written(folder, machine, pi, level: str, part: str, seed: int) -> None:
    """Write one log of a robot whose bodies are pi."""
    t, q, qd, qdd = waved(seed, SECONDS)
    loaded = machine.with_inertias(pi)
    if MASS[level]:
        body = pin.Inertia.FromBox(MASS[level], 0.06, 0.08, 0.12)
        loaded.appendBodyToJoint(loaded.njoints - 1, body, pin.SE3(np.eye(3), np.array(COM)))
    data = loaded.createData()
    tau = np.array([pin.rnea(loaded, data, *row) for row in zip(q, qd, qdd)])
    friction = ROUGH if level in ("one", "three") else 1.0
    tau += (
        friction * 0.4 * qd
        + 0.3 * np.sign(qd)
        + np.random.default_rng(seed).normal(0.0, NOISE, q.shape)
    )
    columns = (
        {"t": t}
        | {f"q_{j}": q[:, k] for k, j in enumerate(JOINTS)}
        | {f"tau_{j}": tau[:, k] for k, j in enumerate(JOINTS)}
    )
    (folder / f"{level}_{part}.csv").write_text(csv(columns))


def experiment(path):
    """Write the experiment and its logs into a folder; returns it."""
    (path / "robot.urdf").write_text(SPATIAL)
    (path / "config.yaml").write_text(dump(tree()))
    machine, *_ = pipeline.build(config.experiment(tree(), path / "config.yaml"))
    pi = LogCholesky(machine.prior).parameters(
        np.random.default_rng(3).normal(scale=0.15, size=(3, 10))
    )
    for k, level in enumerate(MASS):
        for n, part in enumerate(("train", "test")):
            written(path, machine, pi, level, part, 10 * k + n)
    return path
