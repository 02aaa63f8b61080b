"""How close a robot's links come to each other, and to the floor.

The URDF's collision geometry, each mesh as its convex hull: never nearer to another link than the
mesh itself is said to be. Where a URDF has none, a capsule for each link, as long as to its next
joints and as thick as a rod of its inertia. Pairs that move together, or that overlap in the pose
that a motion is about, are not looked at; nor what hangs on neighbouring joints.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from xml.etree import ElementTree

import coal
import numpy as np
import pinocchio as pin

from ..errors import SysidWarning
from ..inertia import pseudo
from ..robot import Robot, reduced
from ..urdf import example_root, package_folders

_THINNEST = 0.02  # m: of a capsule


@dataclass(frozen=True)
class Geometry:
    """A robot's shapes on the Pinocchio model of its moving joints. order (dof,): where each of the
    robot's joints stands in the model's configuration. pairs: how many are looked at."""

    model: pin.Model
    shapes: pin.GeometryModel
    order: np.ndarray
    floor: float | None
    source: str

    @property
    def pairs(self) -> int:
        """Pairs of shapes that are looked at."""
        return len(self.shapes.collisionPairs)

    @property
    def looks(self) -> bool:
        """Whether there is anything to look at."""
        return bool(self.pairs) or self.floor is not None

    def about(self, pose, clearance: float = 0.0) -> Geometry:
        """The same without pairs that are nearer than a clearance [m] at a pose (dof,)."""
        shapes = self.shapes.copy()
        shapes.removeAllCollisionPairs()
        for pair, distance in zip(self.shapes.collisionPairs, self._at(pose)[0]):
            if distance > clearance:
                shapes.addCollisionPair(pair)
        return Geometry(self.model, shapes, self.order, self.floor, self.source)

    def _q(self, pose) -> np.ndarray:
        q = np.empty(self.model.nq)
        q[self.order] = pose
        return q

    def _at(self, pose):
        data, found = self.model.createData(), self.shapes.createData()
        pin.computeDistances(self.model, data, self.shapes, found, self._q(pose))
        return np.array([r.min_distance for r in found.distanceResults]), data, found

    def least(self, q) -> np.ndarray:
        """(n,) least distance [m] of any pair, or above the floor, at poses q (n, dof)."""
        if not self.looks:
            return np.full(len(q), np.inf)
        data, found = self.model.createData(), self.shapes.createData()
        out = np.empty(len(q))
        for k, pose in enumerate(q):
            pin.computeDistances(self.model, data, self.shapes, found, self._q(pose))
            pairs = min((r.min_distance for r in found.distanceResults), default=np.inf)
            out[k] = min(pairs, self._lowest(found)[0] if self.floor is not None else np.inf)
        return out

    def _lowest(self, found) -> tuple[float, int, np.ndarray]:
        """Height [m] above the floor of the lowest point of what moves, its joint and the point."""
        best = (np.inf, 0, np.zeros(3))
        for shape, placed in zip(self.shapes.geometryObjects, found.oMg):
            if shape.parentJoint == 0:
                continue
            corners = _corners(shape.geometry) @ placed.rotation.T + placed.translation
            at = int(np.argmin(corners[:, 2]))
            if (height := float(corners[at, 2] - self.floor)) < best[0]:
                best = (height, shape.parentJoint, corners[at])
        return best

    def near(self, q, within: float) -> list[tuple[int, float, np.ndarray]]:
        """Every pair nearer than `within` [m] at poses q (n, dof): the pose's number, the distance
        [m], and its slope (dof,). The floor is the base's: a pair of its own."""
        out = []
        if not self.looks:
            return out
        data, found = self.model.createData(), self.shapes.createData()
        for k, pose in enumerate(q):
            pin.computeDistances(self.model, data, self.shapes, found, self._q(pose))
            low = self._lowest(found) if self.floor is not None else (np.inf, 0, None)
            if min((r.min_distance for r in found.distanceResults), default=np.inf) >= within and (
                low[0] >= within
            ):
                continue
            pin.computeJointJacobians(self.model, data, self._q(pose))
            for pair, result in zip(self.shapes.collisionPairs, found.distanceResults):
                if result.min_distance >= within:
                    continue
                first, second = (self.shapes.geometryObjects[i] for i in (pair.first, pair.second))
                way = -np.asarray(result.normal)  # from the second to the first
                pull = self._point(data, first.parentJoint, result.getNearestPoint1())
                pull -= self._point(data, second.parentJoint, result.getNearestPoint2())
                out.append((k, float(result.min_distance), (way @ pull)[self.order]))
            if low[0] < within:
                out.append((k, low[0], self._point(data, low[1], low[2])[2][self.order]))
        return out

    def _point(self, data, joint: int, place) -> np.ndarray:
        """Velocity Jacobian (3, nv) of a point [m, base frame] that moves with a joint."""
        if joint == 0:
            return np.zeros((3, self.model.nv))
        jacobian = pin.getJointJacobian(
            self.model, data, joint, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        arm = place - data.oMi[joint].translation
        return jacobian[:3] + np.cross(jacobian[3:], arm, axisa=0).T


def _corners(shape) -> np.ndarray:
    """Points (n, 3) that a shape lies within: a hull's own, else its box's."""
    if isinstance(shape, coal.ConvexBase):
        return np.array(shape.points())
    shape.computeLocalAABB()
    box = shape.aabb_local
    return np.stack(np.meshgrid(*zip(box.min_, box.max_), indexing="ij"), axis=-1).reshape(-1, 3)


def geometry(robot: Robot, floor: float | None = None) -> Geometry:
    """What a robot's links look like. Warns where the URDF does not say, or its meshes are not to
    be found."""
    model, shapes = _stated(robot)
    source = "the URDF's collision geometry, meshes as their convex hulls"
    if not shapes.ngeoms:
        shapes, source = _capsules(robot, model), "capsules as thick as the links' inertia says"
        warnings.warn(
            SysidWarning(f"no collision geometry can be read from the URDF: links are {source}"),
            stacklevel=2,
        )
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
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
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
