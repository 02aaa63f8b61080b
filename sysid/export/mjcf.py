"""MJCF, MuJoCo's own format: damping (with drag as its polynomial's second term), dry friction,
armature and springs of joints, rotors of several joints as tendons with an armature, gravity, and
torque motors."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from .document import frames, indented, numbers
from .stated import Stated

KNOWS = frozenset(
    {
        "damping", "drag", "friction", "armature", "stiffness", "torque", "zero",
        "gravity", "inertia", "shaft",
    }
)  # fmt: skip
SHOWS: frozenset[str] = frozenset()
PACKAGE = "mujoco"
_SHORTEST = 5e-4  # s: time steps of robots' simulations are seldom shorter
CANNOT = "MuJoCo decides the direction of dry friction at rest by itself."


def files(said: Stated, comment: str, folder: Path) -> dict[str, bytes]:
    """{file name: content} of what is said."""
    root = ElementTree.Element("mujoco", model=said.robot.name)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    ElementTree.SubElement(root, "option", gravity=numbers(said.gravity))
    bodies = {-1: ElementTree.SubElement(root, "worldbody")}
    robot = said.robot
    # parents come first in the tree
    for joint in sorted(range(robot.dof), key=lambda k: robot.bodies[k].row):
        row = robot.bodies[joint].row
        bodies[row] = _body(bodies[robot.parents[row]], said, joint)
    for frame in frames(said):
        attributes = _placed(frame.placement.rotation, frame.placement.translation)
        ElementTree.SubElement(bodies[frame.row], "site", name=frame.name, **attributes)
    if said.shafts:
        tendons = ElementTree.SubElement(root, "tendon")
        for shaft in said.shafts:
            fixed = ElementTree.SubElement(tendons, "fixed", name=shaft.name)
            fixed.set("armature", numbers(shaft.inertia))
            for name, ratio in zip(robot.joints, shaft.row):
                if ratio:
                    ElementTree.SubElement(fixed, "joint", joint=name, coef=numbers(ratio))
    _actuators(ElementTree.SubElement(root, "actuator"), said)
    return {"robot.xml": indented(root, f"{comment}\n{CANNOT}")}


def _actuators(parent, said: Stated) -> None:
    """Servos and DC motors where commands were logged, else motors that are given torque."""
    for name in said.robot.joints:
        own = {"name": name, "joint": name}
        effort, drive = said.robot.source.joints[name].effort, said.motors.get(name)
        limit = numbers([-effort, effort]) if np.isfinite(effort) else None
        if drive is None:
            ElementTree.SubElement(
                parent, "motor", **own, **({"ctrlrange": limit} if limit else {})
            )
            continue
        own |= {"forcerange": limit} if limit else {}
        if drive.delay > 0.0:
            # a buffer that holds the delay at any time step down to the shortest
            kept = str(math.ceil(drive.delay / _SHORTEST) + 1)
            own |= {"delay": numbers(drive.delay), "nsample": kept, "interp": "linear"}
        if drive.servo:
            gains = {"kp": numbers(drive.gain), "kv": numbers(drive.damping)}
            ElementTree.SubElement(parent, "position", **own, **gains)
        else:
            gains = {"gainprm": numbers(drive.gain), "biasprm": numbers([0.0, 0.0, -drive.damping])}
            ElementTree.SubElement(parent, "general", biastype="affine", **own, **gains)


def _body(parent, said: Stated, joint: int):
    robot, at = said.robot, {name: float(values[joint]) for name, values in said.terms.items()}
    body, name = robot.bodies[joint], robot.joints[joint]
    place = _placed(robot.rotations[body.row], robot.translations[body.row])
    element = ElementTree.SubElement(parent, "body", name=body.name, **place)
    mass, com, inertia = said.inertias[joint]
    xx, yy, zz, xy, xz, yz = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    full = numbers([xx, yy, zz, xy, xz, yz])
    ElementTree.SubElement(
        element, "inertial", pos=numbers(com), mass=numbers(mass), fullinertia=full
    )
    slides = bool(robot.prismatic[joint])
    axis = robot.subspaces[body.row, :3] if slides else robot.subspaces[body.row, 3:]
    own = {"name": name, "type": "slide" if slides else "hinge", "axis": numbers(axis)}
    if np.isfinite(robot.limits[joint]).all():
        own["range"] = numbers(robot.limits[joint])
    if at["zero"]:
        own["ref"] = numbers(-at["zero"])
    own["damping"] = numbers([at["damping"], at["drag"]] if at["drag"] else at["damping"])
    own |= {"frictionloss": numbers(at["friction"]), "armature": numbers(at["armature"])}
    if at["stiffness"]:
        own["stiffness"] = numbers(at["stiffness"])
        own["springref"] = numbers(said.spring_angle[joint])
    ElementTree.SubElement(element, "joint", **own)
    return element


def _placed(rotation, translation) -> dict[str, str]:
    x, y, z, w = pin.Quaternion(np.array(rotation)).coeffs()
    return {"pos": numbers(translation), "quat": numbers([w, x, y, z])}


def loaded(written: dict[str, Path], said: Stated):
    """MuJoCo's inverse dynamics of the written file, samples (n, dof) -> torque (n, dof), and what
    computed it.

    Raises:
        ImportError: MuJoCo is not installed. ValueError: it refuses the file.
    """
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(written["robot.xml"]))
    # limits and contacts are not of the dynamics; dry friction is solved for, its sign is not the
    # speed's where that is small
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(model)
    at = [model.joint(name).qposadr[0] for name in said.robot.joints]
    rub = model.dof_frictionloss

    def torque(q, qd, qdd):
        out = np.empty(q.shape)
        for k, sample in enumerate(zip(q, qd, qdd)):
            data.qpos[at], data.qvel[at], data.qacc[at] = sample
            mujoco.mj_inverse(model, data)
            out[k] = (data.qfrc_inverse + rub * np.sign(data.qvel))[at]
        return out

    return torque, f"mujoco {mujoco.__version__}"
