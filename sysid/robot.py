"""URDF, chosen joints and rotors -> Robot: a tree of bodies driven by the joint coordinates.

Links and rotors are all Pinocchio bodies. A rotor is a joint of its own, a leaf on the link that carries it,
and the transmission matrix G turns joint speeds into the speeds of every joint of this larger tree:

    q_full = G q,   qd_full = G qd,   tau = G' tau_full,

so gyroscopic terms are exact, and a belt or a differential is another row of G.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from . import urdf, urdf_files
from .errors import RobotError
from .inertia import pseudo
from .link_priors import LINK, link_priors
from .robot_spec import RobotSpec
from .rotors import rotors_of, with_rotors
from .warned import warn


@dataclass(frozen=True)
class Body:
    """A moving rigid body: its name, `link` or `rotor`, the joint that moves it, its row in the full tree."""

    name: str
    kind: str
    joint: str
    row: int


@dataclass(frozen=True)
class Robot:
    """A robot as identification sees it. Arrays are read-only.

    joints: names, in the user's order; every (n, dof) array has this order.
    prismatic: (dof,) bool.
    bodies: links in joint order, then rotors; every (bodies, 10) array has this order.
    parents, rotations, translations, subspaces: the full tree, parents first: parent row (-1 is the base),
        placement of each joint's frame in its parent's (R (3, 3), p (3,)), motion axis [linear, angular].
    transmission: G (rows, dof). gravity: (3,) [m/s^2] in the base frame.
    prior: (bodies, 10) about the joints' frames, physically possible.
    damping, friction: (dof,) what the URDF states.
    limits: (dof, 2) [rad or m] position limits of the URDF, infinite where it states none.
    model: the full tree as a Pinocchio model with the prior inertias.
    """

    name: str
    path: Path
    joints: tuple[str, ...]
    prismatic: np.ndarray
    bodies: tuple[Body, ...]
    parents: np.ndarray
    rotations: np.ndarray
    translations: np.ndarray
    subspaces: np.ndarray
    transmission: np.ndarray
    gravity: np.ndarray
    prior: np.ndarray
    damping: np.ndarray
    friction: np.ndarray
    limits: np.ndarray
    model: pin.Model
    source: urdf.Urdf
    locked: dict[str, float]

    @property
    def dof(self) -> int:
        """Number of joints that move."""
        return len(self.joints)

    def carried(self, joint: int) -> np.ndarray:
        """(bodies,) bool: those that hang on a joint's link, itself among them: its own rotor stays with the motor."""
        on = np.zeros(len(self.parents), dtype=bool)
        for row, parent in enumerate(self.parents):  # parents first
            on[row] = row == self.bodies[joint].row or (parent >= 0 and on[parent])
        return on[[body.row for body in self.bodies]]

    def turned(self, joint: int) -> np.ndarray:
        """(bodies,) bool: the rotors that a joint turns."""
        return np.array([body.kind == "rotor" and self.transmission[body.row, joint] != 0.0 for body in self.bodies])

    def with_inertias(self, pi) -> pin.Model:
        """The full tree as a Pinocchio model with the inertias pi (bodies, 10)."""
        model = self.model.copy()
        for body, parameters in zip(self.bodies, np.asarray(pi)):
            model.inertias[body.row + 1] = pin.Inertia.FromDynamicParameters(pseudo.to_pinocchio(parameters))
        return model


def load(spec: RobotSpec, folder: Path = Path()) -> Robot:
    """Build the robot of an experiment; paths in `spec` are relative to `folder`.

    Raises:
        RobotError: see `urdf.read`; a joint that is not there or not supported; a rotor that cannot be.
    """
    source = urdf.read(urdf_files.locate(spec.urdf, folder))
    model = _pinocchio_model(source)
    moving = [name for name in model.names[1:]]
    joints = tuple(_chosen(spec, source, moving))
    locked = {name: float(spec.lock.get(name, 0.0)) for name in moving if name not in joints}
    model, _ = reduced(model, locked)
    model.gravity.linear = np.array(spec.gravity)
    links = [Body(source.joints[name].child, "link", name, model.getJointId(name) - 1) for name in joints]
    priors = link_priors(source, model, links)
    for body, pi in zip(links, priors):
        model.inertias[body.row + 1] = pin.Inertia.FromDynamicParameters(pseudo.to_pinocchio(pi))
    rotors = rotors_of(spec, source, model, joints)
    model = with_rotors(model, rotors)
    at = lambda name: model.getJointId(name) - 1  # noqa: E731
    bodies = tuple(replace(body, row=at(body.joint)) for body in links)
    bodies += tuple(Body(f"{r.joint}_rotor", "rotor", r.joint, at(f"{r.joint}_rotor")) for r in rotors)
    priors = np.array([*priors, *(rotor.inertia for rotor in rotors)])
    transmission = np.zeros((model.nv, len(joints)))
    transmission[[body.row for body in bodies]] = [*np.eye(len(joints)), *(rotor.speeds for rotor in rotors)]
    stated = [source.joints[name] for name in joints]
    return Robot(
        name=model.name, path=source.path, joints=joints,
        prismatic=_frozen([joint.type == "prismatic" for joint in stated]), bodies=bodies,
        parents=_frozen([model.parents[row + 1] - 1 for row in range(model.nv)]),
        rotations=_frozen([model.jointPlacements[row + 1].rotation for row in range(model.nv)]),
        translations=_frozen([model.jointPlacements[row + 1].translation for row in range(model.nv)]),
        subspaces=_frozen([model.joints[row + 1].createData().S.ravel() for row in range(model.nv)]),
        transmission=_frozen(transmission), gravity=_frozen(spec.gravity), prior=_frozen(priors),
        damping=_frozen([joint.damping for joint in stated]), friction=_frozen([joint.friction for joint in stated]),
        limits=_frozen([joint.limits for joint in stated]), model=model, source=source, locked=locked,
    )  # fmt: skip


def reduced(model: pin.Model, locked: dict[str, float], shapes: pin.GeometryModel | None = None) -> tuple[pin.Model, pin.GeometryModel]:
    """A Pinocchio model, and shapes on it, with joints locked at angles [rad or m]."""
    shapes = pin.GeometryModel() if shapes is None else shapes
    if not locked:
        return model, shapes
    reference = pin.neutral(model)
    for name, angle in locked.items():
        reference[model.joints[model.getJointId(name)].idx_q] = angle
    return pin.buildReducedModel(model, shapes, [model.getJointId(name) for name in locked], reference)


def _frozen(values) -> np.ndarray:
    array = np.array(values)
    array.setflags(write=False)
    return array


def _pinocchio_model(source: urdf.Urdf) -> pin.Model:
    """The whole URDF as a Pinocchio model in which every moving joint has one coordinate."""
    root = ElementTree.fromstring(source.text.encode())
    # only what was checked: its parser writes to standard error what it thinks of the rest (colours, meshes, limits)
    tree = ElementTree.Element("robot", name=root.get("name") or "robot")
    for name in source.links:
        ElementTree.SubElement(tree, "link", name=LINK + name)
    for element in root.findall("joint"):
        joint = source.joints[element.get("name")]
        if joint.type in ("floating", "planar"):
            raise RobotError(
                f"joint {joint.name!r} is {joint.type}", where=str(source.path),
                allowed="revolute, continuous, prismatic, fixed", do="fix the base to the world",
            )
        # Pinocchio would give a continuous joint two coordinates (cos, sin); an unlimited angle serves here
        kept = ElementTree.SubElement(tree, "joint", name=joint.name, type="revolute" if joint.type == "continuous" else joint.type)
        kept.extend(child for child in element if child.tag in ("origin", "axis"))
        for end, link in (("parent", joint.parent), ("child", joint.child)):
            ElementTree.SubElement(kept, end, link=LINK + link)
        if joint.type in urdf.MOVING:
            lower, upper = (repr(float(np.clip(limit, -1e9, 1e9))) for limit in joint.limits)
            ElementTree.SubElement(kept, "limit", lower=lower, upper=upper, effort="1e9", velocity="1e9")
    try:
        return pin.buildModelFromXML(ElementTree.tostring(tree, encoding="unicode"))
    except (ValueError, RuntimeError) as error:
        raise RobotError(f"Pinocchio cannot build it ({error})", where=str(source.path)) from None


HELD = "{} moves with {} (<mimic> in the URDF), and the model holds it still: masses and torques are off by what its motion needs"


def _chosen(spec: RobotSpec, source: urdf.Urdf, moving: list[str]):

    where = str(source.path)
    for name in [*(spec.joints or []), *spec.lock]:
        if name not in source.joints:
            raise RobotError(f"the URDF has no joint {name!r}", where=where, allowed=", ".join(moving), do="correct robot.joints or robot.lock")
        if name not in moving:
            raise RobotError(f"joint {name!r} is {source.joints[name].type} and cannot move", where=where, allowed=", ".join(moving), do="correct robot.joints or robot.lock")
    if spec.joints is not None:
        if twice := sorted({name for name in spec.joints if spec.joints.count(name) > 1}):
            raise RobotError(f"robot.joints names {twice[0]!r} twice", where=where, do="name each joint once")
        if both := sorted(set(spec.joints) & set(spec.lock)):
            raise RobotError(f"joint {both[0]!r} is in robot.joints and in robot.lock", where=where, do="keep it in one of them")
        if not spec.joints:
            raise RobotError("robot.joints is empty", where=where, allowed=", ".join(moving), do="name at least one joint")
    leaders = followers(source)
    mimics = {name: leaders[name] for name in moving if name in leaders and name not in (*spec.lock, *(spec.joints or ()))}
    chosen = [name for name in moving if name not in spec.lock and name not in mimics] if spec.joints is None else spec.joints
    if not chosen:
        raise RobotError("no joint is left to move", where=where, allowed="at least one revolute, continuous or prismatic joint")
    for name, leader in mimics.items():
        if leader in chosen:  # the other finger of a hand that stands still matters to nobody
            warn(f"{HELD.format(name, leader)}; where it has angles and torques of its own, name it in robot.joints", above=3)
    return chosen


def followers(source: urdf.Urdf) -> dict[str | None, str | None]:
    """{joint that mimics another: the one that it follows}."""
    root = ElementTree.fromstring(source.text.encode())
    joints = ((element.get("name"), element.find("mimic")) for element in root.findall("joint"))
    return {name: mimic.get("joint") for name, mimic in joints if mimic is not None}
