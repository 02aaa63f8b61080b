"""The robots of the blind benchmark, and how long and how finely their logs are."""

from __future__ import annotations

from pathlib import Path

from sysid import config

ROOT = Path(__file__).resolve().parent.parent.parent

PLANAR = """<robot name="planar">
 <link name="base"/>
 <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="4"/><inertia ixx="0.01" iyy="0.06" izz="0.06" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <link name="fore"><inertial><origin xyz="0.18 0 0"/><mass value="2.5"/><inertia ixx="0.005" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" effort="200" velocity="6"/></joint>
 <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" effort="100" velocity="6"/></joint>
</robot>
"""
JOINTS = {
    "planar": ("shoulder", "elbow"), "leg": ("abad", "hip", "knee"),
    "ur5": ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"),
    "panda": tuple(f"panda_joint{k}" for k in range(1, 8)),
}  # fmt: skip
SPECS = {
    "ur5": {"urdf": "example-robot-data://ur_description/urdf/ur5_robot.urdf"},
    "panda": {
        "urdf": "example-robot-data://panda_description/urdf/panda.urdf",
        "joints": list(JOINTS["panda"]),
    },
}
RATE = {"planar": 1000.0, "leg": 1000.0, "ur5": 500.0, "panda": 500.0}
SECONDS = {"planar": 20.0, "leg": 20.0, "ur5": 16.0, "panda": 16.0}  # of each log


def experiment_of(robot: str, folder: Path):
    """The experiment and the robot of a name; `folder` for what has to be a file."""
    from sysid import robot as robots
    from sysid.simulate import load

    if robot == "leg":
        experiment, machine, _ = load(ROOT / "configs" / "cheetah3.yaml")
        return experiment, machine
    spec = SPECS.get(robot)
    if spec is None:
        file = folder / "planar.urdf"
        file.write_text(PLANAR)
        spec = {"urdf": str(file)}
    experiment = config.experiment({"robot": spec})
    return experiment, robots.load(experiment.robot)
