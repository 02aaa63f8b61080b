"""SDF, Gazebo's format: damping, dry friction and springs of joints. It has no armature, and
gravity is the world's."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from .document import frames, indented, numbers
from .drake import inverse_dynamics
from .stated import Stated

KNOWS = frozenset({"damping", "friction", "stiffness", "torque", "zero", "inertia"})
SHOWS: frozenset[str] = frozenset()
PACKAGE = "drake"


def files(said: Stated, comment: str, folder: Path) -> dict[str, bytes]:
    """{file name: content} of what is said."""
    robot = said.robot
    root = ElementTree.Element("sdf", version="1.9")
    model = ElementTree.SubElement(root, "model", name=robot.name)
    base = _base(said)
    ElementTree.SubElement(model, "link", name=base)
    fixed = ElementTree.SubElement(model, "joint", name=f"{base}_to_world", type="fixed")
    _text(fixed, "parent", "world")
    _text(fixed, "child", base)
    names = joint_names(said)
    for joint in sorted(range(robot.dof), key=lambda k: robot.bodies[k].row):
        body = robot.bodies[joint]
        row = robot.parents[body.row]
        parent = next((b.name for b in robot.bodies if b.row == row), base)
        _link(model, said, joint, names)
        _joint(model, said, joint, names, parent)
    for frame in frames(said):
        if frame.name == said.robot.source.root:
            continue
        on = next((b.name for b in robot.bodies if b.row == frame.row), base)
        element = ElementTree.SubElement(model, "frame", name=frame.name, attached_to=on)
        _pose(element, frame.placement.rotation, frame.placement.translation)
    return {"robot.sdf": indented(root, comment)}


def joint_names(said: Stated) -> list[str]:
    """What the joints are called: their names, with `_joint` where a link has it, as SDF lets
    nothing share a name."""
    taken = set(said.robot.source.links)
    return [f"{name}_joint" if name in taken else name for name in said.robot.joints]


def _base(said: Stated) -> str:
    root = said.robot.source.root
    return root if root != "world" else "base_of_robot"


def _link(model, said: Stated, joint: int, names: list[str]) -> None:
    element = ElementTree.SubElement(model, "link", name=said.robot.bodies[joint].name)
    ElementTree.SubElement(element, "pose", relative_to=names[joint])
    mass, com, inertia = said.inertias[joint]
    inertial = ElementTree.SubElement(element, "inertial")
    _text(inertial, "pose", numbers([*com, 0.0, 0.0, 0.0]))
    _text(inertial, "mass", numbers(mass))
    moments = ElementTree.SubElement(inertial, "inertia")
    for k, first in enumerate("xyz"):
        for j, second in enumerate("xyz"):
            if j >= k:
                _text(moments, f"i{first}{second}", numbers(inertia[k, j]))


def _joint(model, said: Stated, joint: int, names: list[str], parent: str) -> None:
    robot, at = said.robot, {name: float(values[joint]) for name, values in said.terms.items()}
    body, slides = robot.bodies[joint], bool(robot.prismatic[joint])
    kind = "prismatic" if slides else "revolute"
    element = ElementTree.SubElement(model, "joint", name=names[joint], type=kind)
    axis = robot.subspaces[body.row, :3] if slides else robot.subspaces[body.row, 3:]
    rotation, translation = robot.rotations[body.row], robot.translations[body.row]
    # where the joint's own zero is: the encoder reads `zero` less
    if slides:
        translation = translation + rotation @ axis * at["zero"]
    else:
        rotation = rotation @ pin.exp3(axis * at["zero"])
    _pose(element, rotation, translation, relative_to=parent)
    _text(element, "parent", parent)
    _text(element, "child", body.name)
    own = ElementTree.SubElement(element, "axis")
    _text(own, "xyz", numbers(axis))
    limits = ElementTree.SubElement(own, "limit")
    stated = robot.source.joints[robot.joints[joint]]
    for tag, value in zip(("lower", "upper"), robot.limits[joint]):
        if np.isfinite(value):
            _text(limits, tag, numbers(value))
    for tag, value in (("effort", stated.effort), ("velocity", stated.velocity)):
        if np.isfinite(value):
            _text(limits, tag, numbers(value))
    dynamics = ElementTree.SubElement(own, "dynamics")
    _text(dynamics, "damping", numbers(at["damping"]))
    _text(dynamics, "friction", numbers(at["friction"]))
    _text(dynamics, "spring_reference", numbers(said.spring_angle[joint]))
    _text(dynamics, "spring_stiffness", numbers(at["stiffness"]))


def _pose(parent, rotation, translation, **attributes) -> None:
    quaternion = pin.Quaternion(np.array(rotation)).coeffs()
    element = ElementTree.SubElement(parent, "pose", rotation_format="quat_xyzw", **attributes)
    element.text = numbers([*translation, *quaternion])


def _text(parent, tag: str, content: str) -> None:
    ElementTree.SubElement(parent, tag).text = content


def loaded(written: dict[str, Path], said: Stated):
    """Drake's inverse dynamics of the written file, with the dry friction that stands in it; see
    `mjcf.loaded`."""
    found = ElementTree.parse(written["robot.sdf"]).getroot()
    names = joint_names(said)
    at = {joint.get("name"): joint.find("axis/dynamics/friction") for joint in found.iter("joint")}
    rub = np.array([float(at[name].text) for name in names])
    torque, checker = inverse_dynamics(written["robot.sdf"], names, said)
    return (lambda q, qd, qdd: torque(q, qd, qdd) + rub * np.sign(qd)), checker
