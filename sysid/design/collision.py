"""How close a robot's links come to each other, and to the floor, along a motion.

Every pair's distance is asked of coal at some poses, its keys. Between them a distance changes by no
more than the points of its shapes move, so that most pairs need not be asked again:

    d(q) >= d(q_key) - sum_j r_j |q_j - q_key_j|,

with j the joints between the two links, and r_j the farthest that a point of the outer shape can be
from joint j's axis (one for a joint that slides). The floor is the base's: shapes above it are pairs
of their own.

Source: the bound is that of conservative advancement, Mirtich 1996, ch. 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np
import pinocchio as pin

_EVERY = 8  # poses from one at which all pairs are asked to the next
_SLIDES = 10.0  # m that a joint without limits is taken to slide at most


@dataclass(frozen=True)
class Near:
    """Pairs that are near at poses: each one's pose (m,), number (m,), distance (m,) [m] and the slope of
    that (m, dof)."""

    pose: np.ndarray
    pair: np.ndarray
    distance: np.ndarray
    slope: np.ndarray


@dataclass(frozen=True)
class Geometry:
    """A robot's shapes on the Pinocchio model of its moving joints. order (dof,): where each of the
    robot's joints stands in the model's configuration. floor [m] or None. pairs: how many are looked
    at."""

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
        distances = self.at(np.asarray(pose)[None])[0]
        for pair, distance in zip(self.shapes.collisionPairs, distances):
            if distance > clearance:
                shapes.addCollisionPair(pair)
        return Geometry(self.model, shapes, self.order, self.floor, self.source)

    def at(self, q) -> np.ndarray:
        """Distances [m] of every pair, then above the floor of every shape that moves, (n, pairs +
        shapes), at poses q (n, dof)."""
        out = np.empty((len(q), len(self._reach)))
        data, found = self.model.createData(), self.shapes.createData()
        for own, pose in zip(out, self._whole(q)):
            pin.computeDistances(self.model, data, self.shapes, found, pose)
            own[: self.pairs] = [result.min_distance for result in found.distanceResults]
            own[self.pairs :] = [self._lowest(found, k)[0] for k in self._above]
        return out

    def least(self, q, most: float = np.inf) -> np.ndarray:
        """(n,) least distance [m] of any pair or above the floor at poses q (n, dof), in the order of
        a motion; `most` [m] where it is more."""
        out = np.full(len(q), most)
        if self.looks:
            for k, _, distance, *_ in self._nearer(np.asarray(q), most):
                out[k] = min(out[k], distance)
        return out

    def nearest(self, q) -> float:
        """The least distance [m] of a whole motion (n, dof)."""
        if not self.looks:
            return np.inf
        keys = float(self.at(np.asarray(q)[::_EVERY]).min())
        return float(self.least(q, keys).min())

    def near(self, q, within: float) -> Near:
        """Every pair nearer than `within` [m] at poses q (n, dof), in the order of a motion."""
        found = list(self._nearer(np.asarray(q), within)) if self.looks else []
        if not found:
            none = np.zeros(0, dtype=int)
            return Near(none, none, np.zeros(0), np.zeros((0, len(self.order))))
        pose, pair, distance, way, one, two, jacobian = (list(own) for own in zip(*found))
        way, jacobian = np.array(way), np.array(jacobian)
        slope = np.zeros((len(pose), self.model.nv))
        # the pull of a link's point p in the direction n: n . (v + w x p) = n . v + w . (p x n)
        for point, end, sign in ((one, 0, 1.0), (two, 1, -1.0)):
            turned = np.cross(np.array(point), way)
            own = np.einsum("mi,mij->mj", way, jacobian[:, :3])
            own += np.einsum("mi,mij->mj", turned, jacobian[:, 3:])
            slope += sign * own * self._carried[self._ends[pair][:, end]]
        return Near(np.array(pose), np.array(pair), np.array(distance), slope[:, self.order])

    def _nearer(self, q, within: float):
        """(pose, pair, distance, direction from the second to the first, points of both, joint
        Jacobians at the base's origin) of every pair nearer than `within`."""
        asked = q[_EVERY // 2 :: _EVERY] if len(q) > _EVERY // 2 else q[:1]
        keys = self.at(asked)
        own = np.minimum(np.arange(len(q)) // _EVERY, len(asked) - 1)
        # pairs that may be near, by pose
        may = keys[own] - np.abs(q - asked[own]) @ self._reach.T < within
        data, found = self.model.createData(), self.shapes.createData()
        whole, up = self._whole(q), np.array([0.0, 0.0, 1.0])
        pairs = self.pairs
        for k in np.flatnonzero(may.any(axis=1)).tolist():
            pin.updateGeometryPlacements(self.model, data, self.shapes, found, whole[k])
            jacobian = None
            for pair in np.flatnonzero(may[k]).tolist():
                if pair < pairs:
                    result = pin.computeDistance(self.shapes, found, pair)
                    distance = result.min_distance
                else:
                    distance, point = self._lowest(found, self._above[pair - pairs])
                if distance >= within:
                    continue
                if jacobian is None:
                    jacobian = pin.computeJointJacobians(self.model, data, whole[k]).copy()
                if pair < pairs:
                    way = -np.array(result.normal)
                    ends = np.array(result.getNearestPoint1()), np.array(result.getNearestPoint2())
                else:
                    way, ends = up, (point, point)
                yield k, pair, distance, way, *ends, jacobian

    def _whole(self, q) -> np.ndarray:
        """(n, nq) configurations of the Pinocchio model."""
        out = np.empty((len(q), self.model.nq))
        out[:, self.order] = q
        return out

    def _lowest(self, found, shape: int) -> tuple[float, np.ndarray]:
        """Height [m] above the floor of the lowest point of a shape, and the point."""
        placed = found.oMg[shape]
        corners = self._corners[shape] @ placed.rotation.T + placed.translation
        point = corners[np.argmin(corners[:, 2])]
        return float(point[2] - self.floor), point

    @cached_property
    def _above(self) -> list[int]:
        """Numbers of the shapes that are kept above the floor."""
        shapes = enumerate(self.shapes.geometryObjects)
        return [k for k, shape in shapes if shape.parentJoint] if self.floor is not None else []

    @cached_property
    def _corners(self) -> list[np.ndarray]:
        return [corners(shape.geometry) for shape in self.shapes.geometryObjects]

    @cached_property
    def _ends(self) -> np.ndarray:
        """(pairs, 2) joints that carry the shapes of each pair; the floor's is 0, the base."""
        joint = [shape.parentJoint for shape in self.shapes.geometryObjects]
        pairs = [(joint[pair.first], joint[pair.second]) for pair in self.shapes.collisionPairs]
        return np.array([*pairs, *((joint[k], 0) for k in self._above)], dtype=int).reshape(-1, 2)

    @cached_property
    def _carried(self) -> np.ndarray:
        """(njoints, nv) bool: whether a joint is carried by another, or is it."""
        out = np.zeros((self.model.njoints, self.model.nv), dtype=bool)
        for joint in range(1, self.model.njoints):
            out[joint] = out[self.model.parents[joint]]
            out[joint, self.model.joints[joint].idx_v] = True
        return out

    @cached_property
    def _reach(self) -> np.ndarray:
        """(pairs, dof) by how much a pair's distance can change [m] for each rad or m of a joint."""
        numbers = [(pair.first, pair.second) for pair in self.shapes.collisionPairs]
        numbers += [(k, None) for k in self._above]
        out = np.zeros((len(numbers), self.model.nv))
        for row, shapes, joints in zip(out, numbers, self._ends):
            between = self._carried[joints[0]] != self._carried[joints[1]]
            for shape in shapes:
                if shape is not None:
                    far = self._far(shape)
                    row[between & (far > 0.0)] = far[between & (far > 0.0)]
        return out[:, self.order]

    def _far(self, shape: int) -> np.ndarray:
        """(nv,) how far a shape's points move at most for each rad or m of a joint that carries it;
        zero of others."""
        model, out = self.model, np.zeros(self.model.nv)
        joint = self.shapes.geometryObjects[shape].parentJoint
        placed = self.shapes.geometryObjects[shape].placement
        points = self._corners[shape] @ placed.rotation.T + placed.translation
        reach = float(np.linalg.norm(points, axis=1).max())
        while joint:
            own = model.joints[joint]
            slides = not own.createData().S.ravel()[3:].any()
            out[own.idx_v] = 1.0 if slides else max(reach, 1e-9)
            if slides:
                ends = model.lowerPositionLimit[own.idx_q], model.upperPositionLimit[own.idx_q]
                reach += min(float(np.abs(ends).max()), _SLIDES)
            reach += float(np.linalg.norm(model.jointPlacements[joint].translation))
            joint = model.parents[joint]
        return out


def corners(shape) -> np.ndarray:
    """Points (n, 3) that a shape lies within: a hull's own, else its box's."""
    if isinstance(shape, coal.ConvexBase):
        return np.array(shape.points())
    shape.computeLocalAABB()
    box = shape.aabb_local
    return np.stack(np.meshgrid(*zip(box.min_, box.max_), indexing="ij"), axis=-1).reshape(-1, 3)
