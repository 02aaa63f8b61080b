"""How close a robot's links come to each other, and to the floor, along a motion.

Which pairs may be near is told by spheres about their shapes, of a whole motion at once (`spheres`); these
alone are asked of coal. The floor is the base's: shapes above it are pairs of their own.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np
import pinocchio as pin

from . import spheres

# Poses from one at which all pairs are asked to the next, for a first idea of the least.
_EVERY = 80
_CHUNK = 2048  # poses whose spheres stand in memory at once
_UP = np.array([0.0, 0.0, 1.0])


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
        out = np.empty((len(q), len(self._ends)))
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
            for k, _, distance, *_ in self._asked(q, self._may(np.asarray(q), most)):
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
        q, found, last, pairs = np.asarray(q), [], -1, self.pairs
        asked = self._asked(q, self._may(q, within)) if self.looks else ()
        for pose, pair, distance, data, touch in asked:
            if distance >= within:
                continue
            if pose != last:  # about the base's origin
                last, jacobian = pose, pin.computeJointJacobians(self.model, data).copy()
            if pair < pairs:
                ends = touch.getNearestPoint1(), touch.getNearestPoint2()
                found.append(
                    (pose, pair, distance, -np.array(touch.normal), *map(np.array, ends), jacobian)
                )
            else:
                found.append((pose, pair, distance, _UP, touch, touch, jacobian))
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

    def _may(self, q, within: float) -> np.ndarray:
        """(n, pairs) bool: which pairs, and shapes above the floor, may be nearer than `within` at poses."""
        parts = [q[k : k + _CHUNK] for k in range(0, max(len(q), 1), _CHUNK)]
        return np.concatenate([self._may_here(part, within) for part in parts])

    def _may_here(self, q, within: float) -> np.ndarray:
        frames = spheres.placements(self.model, self._whole(q))
        (whole, size), (parts, sizes) = (self._placed(frames, own) for own in zip(*self._covers))
        first, second = self._numbers
        way = np.moveaxis(whole[..., 0], 2, 0)
        far = np.sqrt(np.sum((way[:, first] - way[:, second]) ** 2, axis=0))
        out = np.empty((len(self._ends), len(q)), dtype=bool)
        out[: self.pairs] = far - size[first] - size[second] < within
        pair, pose = np.nonzero(out[: self.pairs])
        a, b = first[pair], second[pair]
        apart = spheres.apart(parts[a, pose], sizes[a], parts[b, pose], sizes[b])
        out[pair, pose] = apart < within
        for k, shape in enumerate(self._above, self.pairs):
            out[k] = (parts[shape, :, 2] - sizes[shape]).min(axis=1) - self.floor < within
        return out.T

    def _placed(self, frames, covers) -> tuple[np.ndarray, np.ndarray]:
        """Centres (shapes, n, 3, k) of k spheres about each shape in the base's axes, and radii (shapes, k)."""
        out = np.empty((len(covers), len(frames[0][1]), 3, len(covers[0])))
        for own, held, shape in zip(out, covers, self.shapes.geometryObjects):
            turned, origin = frames[shape.parentJoint]
            own[:] = np.matmul(turned, held[:, :3].T) + origin[:, :, None]
        return out, np.array(covers)[..., 3]

    def _asked(self, q, may):
        """(pose, pair, distance, Pinocchio's data there, where it is least: coal's result, or the point above the
        floor) of every pair that may be near (n, pairs) at poses q (n, dof)."""
        data, found = self.model.createData(), self.shapes.createData()
        whole, pairs, last = self._whole(q), self.pairs, -1
        for k, pair in np.argwhere(may).tolist():
            if k != last:
                pin.updateGeometryPlacements(self.model, data, self.shapes, found, whole[k])
                last = k
            if pair < pairs:
                result = pin.computeDistance(self.shapes, found, pair)
                yield k, pair, result.min_distance, data, result
            else:
                distance, point = self._lowest(found, self._above[pair - pairs])
                yield k, pair, distance, data, point

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
    def _covers(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Of each shape, the sphere about it and those about its slabs, in its joint's axes."""
        out = []
        for own, shape in zip(self._corners, self.shapes.geometryObjects):
            points = own @ shape.placement.rotation.T + shape.placement.translation
            out.append((spheres.cover(points, 1), spheres.cover(points, spheres.SLABS)))
        return out

    @cached_property
    def _numbers(self) -> np.ndarray:
        """(2, pairs) numbers of the shapes of each pair."""
        own = [(pair.first, pair.second) for pair in self.shapes.collisionPairs]
        return np.array(own, dtype=int).reshape(-1, 2).T

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


def corners(shape) -> np.ndarray:
    """Points (n, 3) that a shape lies within: a hull's own, else its box's."""
    if isinstance(shape, coal.ConvexBase):
        return np.array(shape.points())
    shape.computeLocalAABB()
    box = shape.aabb_local
    return np.stack(np.meshgrid(*zip(box.min_, box.max_), indexing="ij"), axis=-1).reshape(-1, 3)
