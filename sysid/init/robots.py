"""URDF, xacro or MJCF -> the URDF that an experiment names, and what was lost on the way."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from .. import bounded, urdf, urdf_files
from ..errors import RobotError
from ..silence import silenced
from .guess import Guess
from .words import words

#: words in the names of joints that move a hand and not the arm
GRIPPERS = {"gripper", "finger", "fingers", "hand", "knuckle", "jaw", "claw", "thumb", "grip"}
_BASE = "world"
_TURNING, _UNLIMITED, _SLIDING = "JointModelR", "JointModelRUB", "JointModelP"


@dataclass(frozen=True)
class Machine:
    """A robot file. source: its URDF, checked; written: the URDF's text where the file is none and
    one must be written; guesses: how it was made, and how gravity points; notes: what the URDF does
    not hold."""

    source: urdf.Urdf
    written: str | None
    guesses: tuple[Guess, ...] = ()
    notes: tuple[str, ...] = ()


def grips(joint: urdf.Joint) -> bool:
    """Whether a joint moves a hand, by its name: that of its link tells what it carries, too."""
    return bool(GRIPPERS & {*words(joint.name)})


def read(reference: str) -> Machine:
    """The robot that a file or a reference (example-robot-data://, package://) names.

    Raises:
        RobotError: no robot, one that has no URDF (a floating base, a ball joint), or a package is
        missing.
    """
    path = urdf_files.locate(reference, Path())
    if not path.is_file():
        raise RobotError(
            "there is no such file", where=str(path), do="give a URDF, a xacro or an MJCF file"
        )
    if path.suffix.lower() == ".xacro":
        return _of_xacro(path)
    if urdf.root_of(bounded.read_bytes(path), path).tag == "mujoco":
        return _of_mjcf(path)
    return Machine(urdf.read(path), None)


def _of_xacro(path: Path) -> Machine:
    try:
        from xacrodoc import XacroDoc
    except ImportError:
        raise RobotError(
            "reading a xacro file needs the package xacrodoc",
            where=str(path),
            do="pip install 'sysid[xacro]'",
        ) from None
    try:
        text = XacroDoc.from_file(str(path)).to_urdf_string()
    except Exception as error:  # xacro raises what it likes: of syntax, packages, missing files
        said = (str(error).splitlines() or [type(error).__name__])[0]
        raise RobotError(
            f"xacro cannot expand it ({said})",
            where=str(path),
            do="expand it yourself: xacro FILE > robot.urdf",
        ) from None
    why = "expanded from the xacro file with its default arguments"
    return Machine(urdf.parse(text.encode(), path), text, (Guess("robot.urdf", "robot.urdf", why),))


def _of_mjcf(path: Path) -> Machine:
    import pinocchio as pin

    try:
        with silenced():
            model = pin.buildModelFromMJCF(str(path))
    except Exception as error:  # as Pinocchio's parser raises
        said = (str(error).splitlines() or [type(error).__name__])[0]
        raise RobotError(
            f"Pinocchio cannot read it as MJCF ({said})",
            where=str(path),
            do="export a URDF of the robot",
        ) from None
    text = _urdf_of(model, path)
    why = "links, joints, damping and friction of the MJCF, as Pinocchio reads it"
    lost = [
        "a URDF has no actuators, tendons, equalities or contacts: those of the MJCF are not used"
    ]
    guesses = [Guess("robot.urdf", "robot.urdf", why)]
    if np.any(model.armature > 0.0):
        stated = zip(model.names[1:], model.armature)
        shown = ", ".join(f"{name} {own:.3g}" for name, own in stated if own > 0.0)
        lost.append(f"the MJCF's armature ({shown} kg m2) is in no URDF: it is found from the logs")
    gravity = [float(g) for g in model.gravity.linear]
    if gravity != [0.0, 0.0, -9.81]:
        guesses.append(Guess("robot.gravity", gravity, "the MJCF says so"))
    return Machine(urdf.parse(text.encode(), path), text, tuple(guesses), tuple(lost))


def _urdf_of(model, path: Path) -> str:
    """The URDF of a Pinocchio model with a fixed base and joints of one coordinate."""
    import pinocchio as pin

    bodies = {}
    for frame in model.frames:
        if frame.type == pin.FrameType.BODY:
            bodies.setdefault(frame.parentJoint, frame.name)
    root = ElementTree.Element("robot", name=model.name or path.stem)
    ElementTree.SubElement(root, "link", name=_BASE)
    names = {0: _BASE}
    friction = getattr(model, "upperDryFrictionLimit", None)
    for joint in range(1, model.njoints):
        kind, name = model.joints[joint].shortname(), model.names[joint]
        if (
            not kind.startswith((_TURNING, _SLIDING))
            or "Planar" in kind
            or model.joints[joint].nv != 1
        ):
            raise RobotError(
                f"joint {name!r} is a {kind.removeprefix('JointModel')}",
                where=str(path),
                allowed="hinges and slides, one a body, on a base that is fixed to the world",
                do="fix the base, or split the joint",
            )
        own = bodies.get(joint, f"{name}_link")
        names[joint] = own if own not in names.values() else f"{name}_link"
        inertia = model.inertias[joint]
        link = ElementTree.SubElement(root, "link", name=names[joint])
        if inertia.mass > 0.0:
            stated = ElementTree.SubElement(link, "inertial")
            ElementTree.SubElement(stated, "origin", xyz=_spelled(inertia.lever))
            ElementTree.SubElement(stated, "mass", value=repr(float(inertia.mass)))
            keys = {
                "ixx": (0, 0),
                "ixy": (0, 1),
                "ixz": (0, 2),
                "iyy": (1, 1),
                "iyz": (1, 2),
                "izz": (2, 2),
            }
            ElementTree.SubElement(
                stated,
                "inertia",
                {key: repr(float(inertia.inertia[at])) for key, at in keys.items()},
            )
        place, axis = model.jointPlacements[joint], model.joints[joint].createData().S.ravel()
        turning = kind.startswith(_TURNING)
        at, v = model.joints[joint].idx_q, model.joints[joint].idx_v
        low, high = float(model.lowerPositionLimit[at]), float(model.upperPositionLimit[at])
        endless = turning and (kind.startswith(_UNLIMITED) or not np.isfinite([low, high]).all())
        element = ElementTree.SubElement(
            root,
            "joint",
            name=name,
            type="continuous" if endless else "revolute" if turning else "prismatic",
        )
        ElementTree.SubElement(element, "parent", link=names[model.parents[joint]])
        ElementTree.SubElement(element, "child", link=names[joint])
        ElementTree.SubElement(
            element,
            "origin",
            xyz=_spelled(place.translation),
            rpy=_spelled(pin.rpy.matrixToRpy(place.rotation)),
        )
        ElementTree.SubElement(element, "axis", xyz=_spelled(axis[3:] if turning else axis[:3]))
        most = {
            key: float(limit[v])
            for key, limit in (("effort", model.effortLimit), ("velocity", model.velocityLimit))
        }
        limits = {} if endless else {"lower": repr(max(low, -1e9)), "upper": repr(min(high, 1e9))}
        ElementTree.SubElement(
            element, "limit", limits | {key: repr(min(value, 1e9)) for key, value in most.items()}
        )
        held = {
            "damping": float(model.damping[v]),
            "friction": float(friction[v]) if friction is not None else 0.0,
        }
        ElementTree.SubElement(
            element, "dynamics", {key: repr(max(value, 0.0)) for key, value in held.items()}
        )
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _spelled(vector) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(vector))
