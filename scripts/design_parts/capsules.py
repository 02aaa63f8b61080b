"""Distances between capsules in closed form, with what a design takes links to be where a URDF has no
shapes: rods from joint to joint, as thick as their inertia says. No code of the design's is used."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pinocchio as pin

_THINNEST = 0.02  # m


@dataclass(frozen=True)
class Rod:
    """A capsule on a frame of the tree: from one end of its axis to the other (3,) [m], and its radius."""

    row: int
    start: np.ndarray
    end: np.ndarray
    radius: float


def rods(machine) -> list[Rod]:
    """The rods of a robot's links; caps and all they reach from joint to joint."""
    links, out = {b.row for b in machine.bodies if b.kind == "link"}, []
    for body, (mass, *moments) in zip(machine.bodies, machine.prior):
        if body.row not in links:
            continue
        com = np.array(moments[:3]) / mass
        xx, yy, zz, xy, yz, xz = moments[3:]
        about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        central = about - mass * (com @ com * np.eye(3) - np.outer(com, com))
        radius = max(float(np.sqrt(2.0 * np.linalg.eigvalsh(central)[0] / mass)), _THINNEST)
        ends = [machine.translations[k] for k in sorted(links) if machine.parents[k] == body.row]
        for far in ends or [2.0 * com]:
            length = float(np.linalg.norm(far))
            inner = max(0.5 - radius / length, 0.0) if length > 0.0 else 0.0
            out.append(Rod(body.row, (0.5 - inner) * far, (0.5 + inner) * far, radius))
    return out


def least(machine, q, base, clearance: float) -> float:
    """The least distance [m] at poses q (n, dof) of rods on links that are no neighbours, but for those
    that are closer than the clearance in the base pose; infinite where there are none."""
    own = rods(machine)
    near = lambda a, b: a == b or machine.parents[a] == b or machine.parents[b] == a  # noqa: E731
    pairs = [(a, b) for a, b in combinations(own, 2) if not near(a.row, b.row)]
    of = lambda poses: np.array([_between(machine, poses, a, b) for a, b in pairs])  # noqa: E731
    if not pairs:
        return np.inf
    looked = of(np.asarray(base)[None])[:, 0] > clearance
    return float(of(q)[looked].min(initial=np.inf))


def _between(machine, q, one: Rod, two: Rod) -> np.ndarray:
    """(n,) distance of two rods at poses q (n, dof)."""
    data, ends = machine.model.createData(), np.empty((4, len(q), 3))
    for k, full in enumerate(np.asarray(q) @ machine.transmission.T):
        pin.forwardKinematics(machine.model, data, full)
        for n, (rod, point) in enumerate(
            [(one, one.start), (one, one.end), (two, two.start), (two, two.end)]
        ):
            ends[n, k] = data.oMi[rod.row + 1].act(point)
    return segments(*ends) - one.radius - two.radius


def segments(p, p_end, r, r_end) -> np.ndarray:
    """(n,) distance of segments from p to p_end and from r to r_end (n, 3).

    Source: Ericson 2005, section 5.1.9.
    """
    u, v, w = p_end - p, r_end - r, p - r
    dot = lambda a, b: np.sum(a * b, axis=1)  # noqa: E731
    a, e = np.maximum(dot(u, u), 1e-300), np.maximum(dot(v, v), 1e-300)
    b, c, f = dot(u, v), dot(u, w), dot(v, w)
    across = a * e - b * b
    s = np.where(across > 1e-12 * a * e, (b * f - c * e) / np.where(across > 0.0, across, 1.0), 0.0)
    t = np.clip((b * np.clip(s, 0.0, 1.0) + f) / e, 0.0, 1.0)
    s = np.clip((b * t - c) / a, 0.0, 1.0)
    return np.linalg.norm(w + s[:, None] * u - t[:, None] * v, axis=1)
