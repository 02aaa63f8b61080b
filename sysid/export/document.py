"""What the files share: the comment at their head, numbers, the frames of links that do not move
by themselves."""

from __future__ import annotations

import io
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from ..urdf_export import harmless, tree
from . import motors
from .cost import Cost
from .stated import Stated


@dataclass(frozen=True)
class Frame:
    """A link without a joint of its own: where it stands on the body of a row of the tree, -1 for
    the base."""

    name: str
    row: int
    placement: pin.SE3


def comment(said: Stated, left: tuple[Cost, ...], together: dict[str, float] | None) -> str:
    """The comment that a file opens with: what it is, and what it cannot say."""
    lines = [f"{said.robot.name}, as sysid identified it."]
    if not np.allclose(said.gravity, (0.0, 0.0, -9.81)):
        lines.append(f"Gravity in the base's axes is {numbers(said.gravity)} m/s^2.")
    lines += motors.told(said.motors)
    if not left:
        return "\n".join([*lines, "Nothing of the identified model is left out."])
    lines.append("Left out, with the RMS torque that goes with it on the test logs:")
    lines += [f"  {line(cost)}" for cost in left]
    return "\n".join([*lines, *([f"  together: {felt(together)}"] if together else [])])


def line(cost: Cost) -> str:
    """What is left out, where, and what it costs, in a line."""
    name = cost.what if cost.joint == "*" else f"{cost.what} on {cost.joint}"
    if cost.torque is None:
        return f"{name}: not known, as no test log is at hand"
    alone = [joint for joint, size in cost.torque.items() if size > 0] == [cost.joint]
    return f"{name}: {format(cost.torque[cost.joint], '.3g') if alone else felt(cost.torque)}"


def felt(torque: dict[str, float]) -> str:
    """RMS torques by joint, in words."""
    return ", ".join(f"{joint} {size:.3g}" for joint, size in torque.items() if size > 0) or "none"


def numbers(values) -> str:
    """Numbers as XML holds them, to the last bit."""
    return " ".join(repr(float(value)) for value in np.atleast_1d(values))


def indented(root: ElementTree.Element, said: str) -> bytes:
    """An XML document, a comment at its head."""
    ElementTree.indent(root)
    out = io.BytesIO()
    out.write(b"<?xml version='1.0' encoding='UTF-8'?>\n")
    out.write(f"<!--{harmless(said)}-->\n".encode())
    out.write(ElementTree.tostring(root, encoding="utf-8"))
    out.write(b"\n")
    return out.getvalue()


def frames(said: Stated) -> list[Frame]:
    """The links that no joint of the robot moves by itself: flanges, sensors, tools."""
    robot = said.robot
    still = dict.fromkeys(robot.joints, (0.0, 0.0))
    root = tree(robot, said.links, still).getroot()
    # Pinocchio's parser writes to standard error what it thinks of shapes
    for element in [*root.iter("visual", "collision", "material")]:
        element.getparent().remove(element)
    from lxml import etree

    model = pin.buildModelFromXML(etree.tostring(root, encoding="unicode"))
    rows = {0: -1} | {model.getJointId(body.joint): body.row for body in robot.bodies[: robot.dof]}
    moving = {body.name for body in robot.bodies}
    return [
        Frame(frame.name, rows[frame.parentJoint], frame.placement)
        for frame in model.frames
        if frame.type == pin.FrameType.BODY
        and frame.name not in moving
        and frame.name in robot.source.links
    ]
