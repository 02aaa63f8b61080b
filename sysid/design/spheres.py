"""Spheres about a robot's shapes: which of them may be near at all, of a whole motion at once.

A convex shape is cut into slabs along its longest direction. What is in a slab is the hull of the corners there
and of the edges' ends at its faces; a sphere about these holds it. No two shapes are nearer than
their nearest spheres are.

Source: Hubbard 1996 (sphere trees); Badoiu & Clarkson 2003 (the smallest sphere).
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull, QhullError

SLABS = 4  # of each shape
_ROUNDS = 200  # of the search for a smallest sphere: half a percent too large at most
_ROUNDING = 1e-9  # m


def cover(points, slabs: int) -> np.ndarray:
    """Spheres (slabs, 4), centre and radius [m], that hold the hull of points (n, 3)."""
    points = np.asarray(points, dtype=float)
    try:
        hull = ConvexHull(points)
    except QhullError:  # flat
        return np.tile(_sphere(points), (slabs, 1))
    corners, faces = points[hull.vertices], hull.simplices
    edges = points[np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [0, 2]]])]
    longest = np.linalg.svd(corners - corners.mean(axis=0), full_matrices=False)[2][0]
    along, ends = corners @ longest, edges @ longest
    cuts = np.linspace(along.min(), along.max(), slabs + 1)
    out = []
    for low, high in zip(cuts[:-1], cuts[1:]):
        inside = (along >= low - _ROUNDING) & (along <= high + _ROUNDING)
        held = [corners[inside], *(_at(edges, ends, cut) for cut in (low, high))]
        out.append(_sphere(np.concatenate(held)))
    return np.array(out)


def _at(edges, ends, cut: float) -> np.ndarray:
    """Where edges (m, 2, 3) pass a plane; ends (m, 2): how far along they begin and end."""
    through = (ends[:, 0] - cut) * (ends[:, 1] - cut) < 0.0
    (a, b), share = np.moveaxis(edges[through], 1, 0), ends[through]
    weight = (cut - share[:, :1]) / (share[:, 1:] - share[:, :1])
    return a + weight * (b - a)


def _sphere(points) -> np.ndarray:
    """A sphere (4,) about points (n, 3), hardly larger than the smallest one."""
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    for k in range(_ROUNDS):
        away = np.sum((points - centre) ** 2, axis=1)
        centre = centre + (points[np.argmax(away)] - centre) / (k + 2)
    radius = np.sqrt(np.max(np.sum((points - centre) ** 2, axis=1)))
    return np.append(centre, radius + _ROUNDING)


def placements(model: pin.Model, q) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rotation (n, 3, 3) and origin (n, 3) in the base's axes of every joint's frame, the base's first,
    at configurations q (n, nq) of a model whose joints turn or slide."""
    n = len(q)
    out = [(np.repeat(np.eye(3)[None], n, axis=0), np.zeros((n, 3)))]
    for k in range(1, model.njoints):
        turned, origin = out[model.parents[k]]
        own, joint = model.jointPlacements[k], model.joints[k]
        linear, angular = np.split(joint.createData().S.ravel(), 2)
        angle = q[:, joint.idx_q, None]
        origin = origin + turned @ own.translation
        turned = turned @ own.rotation
        origin = origin + (turned @ linear) * angle
        if angular.any():
            turned = turned @ _turn(angular, angle[:, :, None])
        out.append((turned, origin))
    return out


def _turn(axis, angle) -> np.ndarray:
    """(n, 3, 3) rotations about an axis, by Rodrigues' formula."""
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * (skew @ skew)


def apart(one, of_one, two, of_two) -> np.ndarray:
    """(m,) [m] what spheres of two shapes keep between them at least, of centres (m, 3, k) and radii (m, k)."""
    way = one[:, :, :, None] - two[:, :, None, :]
    far = np.sqrt(np.einsum("mixy,mixy->mxy", way, way))
    return (far - of_one[:, :, None] - of_two[:, None, :]).min(axis=(1, 2))
