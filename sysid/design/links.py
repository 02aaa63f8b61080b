"""What a robot's links look like: shapes on the Pinocchio model of its moving joints.

The URDF's collision geometry, each mesh as its convex hull: never nearer to another link than the
mesh itself is said to be. Where a URDF has none, a capsule for each link, as long as to its next
joints and as thick as a rod of its inertia. Pairs that move together are not looked at; nor what
hangs on neighbouring joints.
"""

from __future__ import annotations

from xml.etree import ElementTree

import coal
import numpy as np
import pinocchio as pin

from ..inertia import pseudo
from ..robot import Robot, reduced
from ..urdf_files import example_root, package_folders
from ..warned import unheard, warn
from .collision import Geometry

_THINNEST = 0.02  # m: of a capsule


def geometry(robot: Robot, floor: float | None = None) -> Geometry:
    """What a robot's links look like. Warns where the URDF does not say, or its meshes are not to
    be found."""
    model, shapes = _stated(robot)
    source = "the URDF's collision geometry, meshes as their convex hulls"
    if not shapes.ngeoms:
        shapes, source = _capsules(robot, model), "capsules as thick as the links' inertia says"
        warn(f"no collision geometry can be read from the URDF: links are {source}")
    near = {(j, int(model.parents[j])) for j in range(1, model.njoints)}
    for a, one in enumerate(shapes.geometryObjects):
        for b, two in enumerate(shapes.geometryObjects[:a]):
            i, j = one.parentJoint, two.parentJoint
            if i != j and (i, j) not in near and (j, i) not in near:
                shapes.addCollisionPair(pin.CollisionPair(b, a))
    order = np.array([model.joints[model.getJointId(name)].idx_q for name in robot.joints])
    return Geometry(model, shapes, order, floor, source)


def _tree(robot: Robot) -> ElementTree.Element:
    """The URDF without what only pictures need, every moving joint with one coordinate."""
    root = ElementTree.fromstring(robot.source.text.encode())
    for link in root.findall("link"):
        for child in list(link):
            if child.tag != "collision":
                link.remove(child)
    for child in list(root):
        if child.tag not in ("link", "joint"):
            root.remove(child)
        elif child.tag == "joint" and child.get("type") == "continuous":
            child.set("type", "revolute")
            for limit in child.findall("limit"):
                child.remove(limit)
            ElementTree.SubElement(
                child, "limit", lower="-1e9", upper="1e9", effort="1e9", velocity="1e9"
            )
    return root


def _stated(robot: Robot) -> tuple[pin.Model, pin.GeometryModel]:
    """The model of the moving joints, and the URDF's shapes on it: none where they cannot be read."""
    text = ElementTree.tostring(_tree(robot), encoding="unicode")
    whole = pin.buildModelFromXML(text)
    folders = [str(p) for p in (*package_folders(), example_root().parents[1], *robot.path.parents)]
    try:
        with unheard():
            shapes = pin.buildGeomFromUrdfString(
                whole, text, pin.GeometryType.COLLISION, package_dirs=folders
            )
    except (ValueError, RuntimeError):
        shapes = pin.GeometryModel()
    for shape in shapes.geometryObjects:
        if isinstance(shape.geometry, coal.BVHModelBase):
            shape.geometry = _hull(shape.geometry)
    return reduced(whole, robot.locked, shapes)


def _hull(mesh: coal.BVHModelBase) -> coal.Convex:
    """The convex hull of a mesh. Its own `buildConvexRepresentation` gives hulls whose distances are
    wrong by centimetres (coal 3.0); this one's are those of a quadratic program over its points."""
    points = coal.StdVec_Vec3s()
    for point in np.array(mesh.vertices()):
        points.append(point)
    return coal.ConvexBase.convexHull(points, True, "Qt")


def _capsules(robot: Robot, model: pin.Model) -> pin.GeometryModel:
    """A capsule along every line from a joint to the next, the last one to its centre of mass."""
    shapes = pin.GeometryModel()
    for body, pi in zip(robot.bodies, robot.prior):
        if body.kind != "link":
            continue
        joint = model.getJointId(body.joint)
        mass, com, central = pseudo.to_central(pi)
        # a rod's moment about its own axis is m r^2 / 2
        radius = max(float(np.sqrt(2.0 * np.linalg.eigvalsh(central)[0] / mass)), _THINNEST)
        ends = [
            model.jointPlacements[k].translation
            for k in range(1, model.njoints)
            if model.parents[k] == joint
        ]
        for end in ends or [2.0 * com]:
            length = float(np.linalg.norm(end))
            turn = (
                pin.Quaternion.FromTwoVectors(
                    np.array([0.0, 0.0, 1.0]), np.asarray(end, dtype=float)
                )
                if length > 0
                else pin.Quaternion.Identity()
            )
            placed = pin.SE3(turn.matrix(), 0.5 * np.asarray(end, dtype=float))
            shape = coal.Capsule(radius, max(length - 2.0 * radius, 0.0))
            shapes.addGeometryObject(
                pin.GeometryObject(f"{body.name}_{shapes.ngeoms}", joint, placed, shape)
            )
    return shapes
