"""A URDF that says what cannot be, or that holds what is not read, is refused."""

import math
from pathlib import Path

import numpy as np

from .errors import RobotError

_ELSEWHERE = ("xacro", "xinclude")  # in the name spaces of elements that stand for others


# What identification does not use, but the identified URDF repeats: {element: {attribute: how many numbers}}.
_REPEATED = {
    "color": {"rgba": 4}, "mesh": {"scale": 3}, "limit": {"effort": 1, "velocity": 1}, "mimic": {"multiplier": 1, "offset": 1},
    "calibration": {"rising": 1, "falling": 1}, "safety_controller": {"soft_lower_limit": 1, "soft_upper_limit": 1, "k_position": 1, "k_velocity": 1},
}  # fmt: skip


_REFERS = {"mesh": "filename", "texture": "filename", "mimic": "joint"}


def check_whole(root, path: Path) -> None:
    """Refuse what stands for something else: the robot is not all there."""
    for element in root.iter():
        space, _, tag = str(element.tag).rpartition("}")
        if any(word in space.lower() for word in _ELSEWHERE):
            raise RobotError(f"the element <{space.rpartition('/')[2]}:{tag}> stands for others, which are not in the file", where=str(path), do="expand it first: xacro FILE > robot.urdf")
    for element in [*root.findall("link"), *root.findall("joint")]:
        for one in (element, *element.findall("parent"), *element.findall("child")):
            if word := next((value for value in one.attrib.values() if "${" in value or "$(" in value), None):
                raise RobotError(f"{word[:60]!r} in <{one.tag}> is an expression of xacro", where=str(path), do="expand it first: xacro FILE > robot.urdf")


def check_mimics(root, joints, path: Path) -> None:
    """Refuses a mimic of a joint that is not there."""
    for element in root.findall("joint"):
        mimic = element.find("mimic")
        if mimic is not None and mimic.get("joint") not in joints:
            raise RobotError(f"joint {element.get('name')!r} mimics {mimic.get('joint')!r}, which is missing", where=str(path), allowed=_some(joints), do="correct or remove <mimic>")


def check_rest(root, path: Path) -> None:
    """Refuses numbers that are none, and references to nothing, in what is not used here."""
    for owner in [*root.findall("link"), *root.findall("joint"), *root.findall("material")]:
        for element in owner.iter():
            for attribute, count in _REPEATED.get(element.tag, {}).items():
                numbers(element, attribute, count, " ".join("0" * count), path, f"{owner.tag} {owner.get('name')!r}")
            if (key := _REFERS.get(element.tag)) and not element.get(key):
                raise RobotError(f"{owner.tag} {owner.get('name')!r} has a <{element.tag}> without {key}", where=str(path), do="name it or remove it")
            if element.tag == "geometry" and not len(element):
                raise RobotError(
                    f"link {owner.get('name')!r} has an empty <geometry>", where=str(path), allowed="box, cylinder, sphere, mesh", do="remove it"
                )


def check_tree(links, joints, path: Path) -> None:
    """Refuses links and joints that are no tree."""
    if not links:
        raise RobotError("there is no link in it", where=str(path), do="give a URDF of a robot")
    parent_joint: dict = {}
    for joint in joints.values():
        for end, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in links:
                raise RobotError(
                    f"joint {joint.name!r} has the {end} link {link!r}, which is missing",
                    where=str(path),
                    allowed=_some(links),
                    do="add the link or correct the name",
                )
        if joint.child in parent_joint:
            raise RobotError(
                f"link {joint.child!r} hangs on two joints, {parent_joint[joint.child].name!r} and {joint.name!r} (a loop)",
                where=str(path),
                allowed="a tree",
                do="cut the loop at one joint",
            )
        parent_joint[joint.child] = joint
    roots = [name for name in links if name not in parent_joint]
    for name in links:
        seen, here = set(), name
        while here in parent_joint:
            if here in seen:
                raise RobotError(f"link {name!r} is part of a loop", where=str(path), allowed="a tree", do="cut the loop at one joint")
            seen.add(here)
            here = parent_joint[here].parent
    if len(roots) != 1:
        raise RobotError(f"the links {_some(roots)} hang on nothing", where=str(path), allowed="one root", do="connect them")


def _some(names, most: int = 12) -> str:
    names = list(names)
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


# nothing of a robot is larger in SI units, and its square is still a number; a limit beyond it is none
LARGEST = 1e12


_UNLIMITED = ("limit", "safety_controller")


def numbers(element, attribute: str, count: int, default: str, path: Path, owner: str) -> np.ndarray:
    """(count,) the finite numbers that an attribute holds. Raises RobotError."""
    text = element.get(attribute, default) if element is not None else default
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.array([])
    most = math.inf if (element is not None and element.tag in _UNLIMITED) else LARGEST
    if values.shape != (count,) or not (np.abs(values) <= most).all():
        tag = element.tag if element is not None else attribute
        what = "a finite number" if count == 1 else f"{count} finite numbers"
        raise RobotError(
            f"{owner}: <{tag} {attribute}={text[:60]!r}>",
            where=str(path),
            allowed=what + ("" if most == math.inf else f", at most {LARGEST:g} in size"),
            do="correct it",
        )
    return values
