"""URDF text, checked before anything is built on it: a tree of links with the inertias it states.

XML with a document type or entities is refused (a billion laughs, or a file read through one); meshes are
never opened. What Pinocchio would report as a C++ exception is found here first, with the name of the link.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from . import bounded
from .errors import RobotError
from .inertia import pseudo
from .urdf_checks import LARGEST, check_mimics, check_rest, check_tree, check_whole, numbers

MOVING = ("revolute", "continuous", "prismatic")
TYPES = MOVING + ("fixed", "floating", "planar")
_DEEPEST = 50  # elements in elements; a URDF has six


@dataclass(frozen=True)
class Link:
    """A link as the URDF states it; `inertial` is (10,) about the link's frame, None where it states none."""

    name: str
    inertial: np.ndarray | None
    geometry: np.ndarray | None  # (10,) of a uniform solid of its primitive shapes at water's density
    has_geometry: bool


@dataclass(frozen=True)
class Joint:
    """A joint as the URDF states it; `damping` [N m s/rad] and `friction` [N m] from `<dynamics>`, `limits` [rad or m], and
    what it may do at most, infinite where nothing is stated: `velocity` [rad/s or m/s], `effort` [N m or N]."""

    name: str
    type: str
    parent: str
    child: str
    damping: float
    friction: float
    limits: tuple[float, float]
    velocity: float = math.inf
    effort: float = math.inf


@dataclass(frozen=True)
class Urdf:
    """The checked file: its text (comments and encoding aside) and its tree."""

    path: Path
    text: str
    links: dict[str, Link]
    joints: dict[str, Joint]

    @property
    def root(self) -> str:
        """The link that no joint moves."""
        children = {joint.child for joint in self.joints.values()}
        return next(name for name in self.links if name not in children)


def read(path: Path) -> Urdf:
    """Read and check a URDF.

    Raises:
        RobotError: not there, not XML, entities, a loop, a missing link, numbers that are no numbers.
    """
    try:
        data = bounded.read_bytes(path)
    except OSError as error:
        raise RobotError(f"no URDF can be read there ({error.strerror})", where=str(path), do="check robot.urdf") from None
    return parse(data, path)


def parse(data: bytes, path: Path) -> Urdf:
    """`read` for bytes already in memory; `path` only names them in messages."""
    root = root_of(data, path)
    if root.tag != "robot":
        raise RobotError(f"the root element is <{root.tag}>", where=str(path), allowed="<robot>", do="give a URDF, not a xacro or SDF")
    check_whole(root, path)
    links: dict[str, Link] = {}
    for element in root.findall("link"):
        link = _link(element, path)
        if link.name in links:
            raise RobotError(f"link {link.name!r} appears twice", where=str(path), do="rename one")
        links[link.name] = link
    joints: dict[str, Joint] = {}
    for element in root.findall("joint"):
        joint = _joint(element, path)
        if joint.name in joints:
            raise RobotError(f"joint {joint.name!r} appears twice", where=str(path), do="rename one")
        joints[joint.name] = joint
    check_rest(root, path)
    check_mimics(root, joints, path)
    check_tree(links, joints, path)
    root.set("name", root.get("name") or "robot")
    return Urdf(path=path, text=ElementTree.tostring(root, encoding="unicode"), links=links, joints=joints)


def root_of(data: bytes, path: Path) -> ElementTree.Element:
    """The root element of an XML text; `path` only names it in messages.

    Raises:
        RobotError: not XML, or XML with a document type or entities.
    """

    def refuse(*_):
        raise RobotError("the XML declares a document type or entities", where=str(path), allowed="plain elements", do="remove <!DOCTYPE …>")

    depth = [0]

    def deeper(*_):
        depth[0] += 1
        if depth[0] > _DEEPEST:
            raise RobotError(f"elements more than {_DEEPEST} deep", where=str(path), do="give a URDF file")

    def back(*_):
        depth[0] -= 1

    checker = expat.ParserCreate()
    checker.StartElementHandler, checker.EndElementHandler = deeper, back
    checker.StartDoctypeDeclHandler = refuse
    checker.EntityDeclHandler = refuse
    try:
        checker.Parse(data, True)
        return ElementTree.fromstring(data)
    except (expat.ExpatError, ElementTree.ParseError, ValueError, LookupError) as error:
        # a prefix of xacro's that nobody has expanded
        do = "run xacro on it and give the URDF that it prints" if b"xacro:" in data else "give a URDF file"
        raise RobotError(f"not XML ({error})", where=str(path), do=do) from None


def rotation_rpy(rpy) -> np.ndarray:
    """Rotation matrix of URDF's fixed-axis roll, pitch, yaw [rad]."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(a), math.cos(a)) for a in rpy)
    return np.array([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ])  # fmt: skip


def rpy_of(turn) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad] of a rotation matrix (3, 3), as `rotation_rpy` reads them; no roll where the pitch is a right angle."""
    level = math.hypot(turn[0][0], turn[1][0])  # cos of the pitch
    pitch = math.atan2(-turn[2][0], level)
    if level < 1e-12:
        return 0.0, pitch, math.atan2(-turn[0][1], turn[1][1])
    return math.atan2(turn[2][1], turn[2][2]), pitch, math.atan2(turn[1][0], turn[0][0])


def _pose(element, path: Path, owner: str):
    origin = element.find("origin")
    xyz = numbers(origin, "xyz", 3, "0 0 0", path, owner)
    return rotation_rpy(numbers(origin, "rpy", 3, "0 0 0", path, owner)), xyz


def _link(element, path: Path) -> Link:
    name = element.get("name")
    if not name:
        raise RobotError("a <link> has no name", where=str(path), do="name it")
    owner = f"link {name!r}"
    inertial = None
    if (stated := element.find("inertial")) is not None:
        turn, com = _pose(stated, path, owner)
        mass = numbers(stated.find("mass"), "value", 1, "0", path, owner)[0]
        xx, xy, xz, yy, yz, zz = (numbers(stated.find("inertia"), key, 1, "0", path, owner)[0] for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
        central = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        inertial = pseudo.from_central(mass, com, turn @ central @ turn.T)
    seen, touched = ([_solid(shape, path, owner) for shape in element.findall(kind)] for kind in ("visual", "collision"))
    solids = [solid for solid in touched or seen if solid is not None]
    return Link(name, inertial, np.sum(solids, 0) if solids else None, bool(touched or seen))


def _solid(shape, path: Path, owner: str) -> np.ndarray | None:
    """A uniform solid of 1000 kg/m^3 for a primitive shape; None for a mesh."""
    turn, xyz = _pose(shape, path, owner)
    geometry = shape.find("geometry")
    if geometry is None:
        return None
    origin = np.zeros(3)
    if (box := geometry.find("box")) is not None:
        edges = np.abs(numbers(box, "size", 3, "", path, owner))
        solid = pseudo.box(1000.0 * edges.prod(), origin, edges)
    elif (cylinder := geometry.find("cylinder")) is not None:
        radius, length = (abs(numbers(cylinder, key, 1, "", path, owner)[0]) for key in ("radius", "length"))
        solid = pseudo.cylinder(1000.0 * math.pi * radius**2 * length, origin, radius, length)
    elif (sphere := geometry.find("sphere")) is not None:
        radius = abs(numbers(sphere, "radius", 1, "", path, owner)[0])
        solid = pseudo.sphere(1000.0 * 4.0 / 3.0 * math.pi * radius**3, origin, radius)
    else:
        return None
    return pseudo.displaced(solid, turn, xyz) if solid[0] > 0 else None


def _joint(element, path: Path) -> Joint:
    name, kind = element.get("name"), element.get("type")
    if not name:
        raise RobotError("a <joint> has no name", where=str(path), do="name it")
    if kind not in TYPES:
        raise RobotError(f"joint {name!r} is of type {kind!r}", where=str(path), allowed=", ".join(TYPES))
    ends = []
    for end in ("parent", "child"):
        found = element.find(end)
        if found is None or not found.get("link"):
            raise RobotError(f"joint {name!r} names no {end} link", where=str(path), allowed=f'<{end} link="…"/>', do="name it")
        ends.append(found.get("link"))
    dynamics = element.find("dynamics")
    damping, friction = (numbers(dynamics, key, 1, "0", path, f"joint {name!r}")[0] for key in ("damping", "friction"))
    # `lower` and `upper` are 0 where a limit leaves them out
    lower, upper = (
        (numbers(limit, key, 1, "0", path, f"joint {name!r}")[0] for key in ("lower", "upper"))
        if (limit := element.find("limit")) is not None
        else (-math.inf, math.inf)
    )
    _pose(element, path, f"joint {name!r}")
    if kind in MOVING:
        axis = numbers(element.find("axis"), "xyz", 3, "1 0 0", path, f"joint {name!r}")
        if not np.linalg.norm(axis) > 0:
            raise RobotError(f"joint {name!r} has the axis 0 0 0", where=str(path), allowed="a direction")
    # zero is what exporters write where nobody knows
    most = [(numbers(limit, key, 1, "0", path, f"joint {name!r}")[0] if limit is not None else 0.0) or math.inf for key in ("velocity", "effort")]
    lower, upper, *most = (math.copysign(math.inf, value) if abs(value) > LARGEST else value for value in (lower, upper, *most))
    # a joint that moves has a range: who states none, or a single place, states no limit
    bounds = (lower, upper) if kind not in MOVING or (kind != "continuous" and lower < upper) else (-math.inf, math.inf)
    return Joint(name, kind, ends[0], ends[1], damping, friction, bounds, *most)
