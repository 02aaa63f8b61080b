"""Rotors as bodies of their own, driven through the transmission."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from . import prior, urdf
from .errors import RobotError
from .inertia import pseudo
from .inertia.consistency import is_consistent
from .link_priors import LINK
from .robot_spec import InertiaSpec, RobotSpec


def body_from(inertia: InertiaSpec) -> np.ndarray:
    """Parameters (10,) about the body's frame of an inertia written in an experiment file."""
    if inertia.parameters is not None:
        return np.array(inertia.parameters, dtype=float)
    if inertia.box is not None:
        return pseudo.box(inertia.mass, inertia.com, inertia.box)
    return pseudo.cylinder(inertia.mass, inertia.com, inertia.cylinder.radius, inertia.cylinder.length)


@dataclass(frozen=True)
class Rotor:
    """A rotor placed in the tree of links: its joint, the joint id that carries it, pose, axis, inertia, row of G."""

    joint: str
    carrier: int
    placement: pin.SE3
    axis: np.ndarray
    inertia: np.ndarray
    speeds: np.ndarray


def rotors_of(spec: RobotSpec, source: urdf.Urdf, model: pin.Model, joints: tuple[str, ...]) -> list[Rotor]:
    """The rotors of an experiment on their links, before they stand in a tree. Raises RobotError."""
    for name in spec.transmission:
        if name not in [rotor.joint for rotor in spec.rotors]:
            raise RobotError(f"robot.transmission has a row for {name!r}, which has no rotor", allowed=", ".join(r.joint for r in spec.rotors) or "nothing: robot.rotors is empty", do="name the joint of a rotor")
    out: list[Rotor] = []
    for rotor in spec.rotors:
        where = f"robot.rotors: rotor of {rotor.joint!r}"
        if rotor.joint not in joints:
            raise RobotError("no such joint moves", where=where, allowed=", ".join(joints), do="correct robot.rotors")
        if rotor.joint in [other.joint for other in out]:
            raise RobotError("the joint has two rotors", where=where, allowed="one rotor a joint")
        if rotor.on not in source.links:
            raise RobotError(f"on: {rotor.on!r} is no link of the URDF", where=where, allowed=", ".join(source.links), do="name the link that carries the motor")
        inertia = body_from(rotor.inertia)
        if not (is_consistent(inertia) and prior.measurable(inertia)):
            raise RobotError("its prior inertia is impossible", where=where, allowed=f"mass > {prior.LIGHTEST:g} kg and edges > 0")
        if model.existJointName(f"{rotor.joint}_rotor"):
            raise RobotError(f"the URDF has a joint {rotor.joint}_rotor of its own", where=where, do="rename it, or leave the rotor out")
        row = np.zeros(len(joints))
        for joint, ratio in (spec.transmission.get(rotor.joint) or {rotor.joint: rotor.ratio}).items():
            if joint not in joints:
                raise RobotError(f"robot.transmission names the joint {joint!r}", where=where, allowed=", ".join(joints))
            row[joints.index(joint)] = ratio
        frame = model.frames[model.getFrameId(LINK + rotor.on, pin.FrameType.BODY)]
        placement = frame.placement * pin.SE3(urdf.rotation_rpy(rotor.rpy), np.array(rotor.xyz))
        axis = np.array(rotor.axis) / np.linalg.norm(rotor.axis)
        out.append(Rotor(rotor.joint, frame.parentJoint, placement, axis, inertia, row))
    return out


def with_rotors(model: pin.Model, rotors: list[Rotor]) -> pin.Model:
    """The model with each rotor a leaf right behind its carrier: Pinocchio's mass-matrix algorithms need every
    subtree to be one run of joints, and appending at the end would break that without a word."""
    tree = pin.Model()
    tree.name, tree.gravity = model.name, model.gravity
    identity = pin.SE3.Identity()

    def mount(carrier: int, parent: int) -> None:
        for rotor in rotors:
            if rotor.carrier == carrier:
                joint = tree.addJoint(parent, pin.JointModelRevoluteUnaligned(rotor.axis), rotor.placement, f"{rotor.joint}_rotor")
                tree.appendBodyToJoint(joint, pin.Inertia.FromDynamicParameters(pseudo.to_pinocchio(rotor.inertia)), identity)

    mount(0, 0)
    for old in range(1, model.njoints):
        parent = tree.getJointId(model.names[model.parents[old]]) if model.parents[old] else 0
        joint = tree.addJoint(parent, model.joints[old], model.jointPlacements[old], model.names[old])
        tree.appendBodyToJoint(joint, model.inertias[old], identity)
        mount(old, joint)
    return tree
