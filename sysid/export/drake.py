"""Drake's URDF: damping of joints, rotors as `drake:rotor_inertia` behind a `drake:gear_ratio`.
Dry friction stands in the file and Drake ignores it."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from ..urdf_export import text, tree
from .stated import Stated

KNOWS, SHOWS = frozenset({"damping", "armature", "zero", "inertia"}), frozenset({"friction"})
PACKAGE = "drake"
_SPACE = "http://drake.mit.edu"


def files(said: Stated, comment: str, folder: Path) -> dict[str, bytes]:
    """{file name: content} of what is said."""
    from lxml import etree

    robot, at = said.robot, said.terms
    dynamics = dict(zip(robot.joints, zip(at["damping"].tolist(), at["friction"].tolist())))
    written = tree(robot, said.links, dynamics, zero=at["zero"], folder=folder)
    root = etree.Element("robot", nsmap={"drake": _SPACE}, attrib=dict(written.getroot().attrib))
    root.extend(list(written.getroot()))
    for limit in root.iterfind("joint/limit"):
        if float(limit.get("effort", "inf")) == 0.0:
            del limit.attrib["effort"]  # Drake would leave such a joint without its rotor
    for name, armature, ratio in zip(robot.joints, at["armature"], _ratios(said)):
        drive = etree.SubElement(root, "transmission", name=f"{name}_transmission")
        etree.SubElement(drive, "type").text = "transmission_interface/SimpleTransmission"
        etree.SubElement(drive, "joint", name=name)
        motor = etree.SubElement(drive, "actuator", name=f"{name}_motor")
        for tag, value in (("rotor_inertia", armature / ratio**2), ("gear_ratio", ratio)):
            etree.SubElement(motor, f"{{{_SPACE}}}{tag}", value=repr(float(value)))
    return {"robot.urdf": text(etree.ElementTree(root), comment)}


def _ratios(said: Stated) -> np.ndarray:
    """(dof,) gear ratio of each joint's own rotor, 1 where it has none."""
    robot, out = said.robot, np.ones(said.robot.dof)
    for body in robot.bodies[robot.dof :]:
        row = robot.transmission[body.row]
        if np.count_nonzero(row) == 1:
            out[row.argmax() if row.max() > 0 else row.argmin()] = row[np.flatnonzero(row)[0]]
    return out


def loaded(written: dict[str, Path], said: Stated):
    """Drake's inverse dynamics of the written file; see `mjcf.loaded`."""
    root = said.robot.source.root
    weld = None if root == "world" else root  # Drake welds a link of that name by itself
    return inverse_dynamics(written["robot.urdf"], list(said.robot.joints), said, weld=weld)


def inverse_dynamics(path: Path, joints: list[str], said: Stated, *, weld: str | None = None):
    """Drake's inverse dynamics of a file, samples (n, dof) -> torque (n, dof), and what computed
    it.

    Args:
        joints: what the file calls the joints. weld: the link to fix to the world.

    Raises:
        ImportError: Drake is not installed. RuntimeError: it refuses the file.
    """
    from importlib.metadata import version

    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import MultibodyForces

    log = logging.getLogger("drake")
    level = log.level
    log.setLevel(logging.ERROR)  # it says that it ignores friction, which the comment says too
    try:
        plant = MultibodyPlant(0.0)
        (robot,) = Parser(plant).AddModels(str(path))
        if weld is not None:
            plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(weld, robot))
        plant.mutable_gravity_field().set_gravity_vector(said.gravity)
        plant.Finalize()
    finally:
        log.setLevel(level)
    at = [plant.GetJointByName(name, robot).velocity_start() for name in joints]
    context, forces = plant.CreateDefaultContext(), MultibodyForces(plant)

    def torque(q, qd, qdd):
        out, full = np.empty(q.shape), np.zeros((3, plant.num_velocities()))
        for k, sample in enumerate(zip(q, qd, qdd)):
            full[:, at] = sample
            plant.SetPositions(context, full[0])
            plant.SetVelocities(context, full[1])
            plant.CalcForceElementsContribution(context, forces)
            out[k] = plant.CalcInverseDynamics(context, full[2], forces)[at]
        return out

    return torque, f"drake {version('drake')}"
