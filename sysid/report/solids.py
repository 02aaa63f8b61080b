"""Bodies as the solids that a page can draw: the uniform ellipsoid with mass, centre and inertia.

A uniform ellipsoid of mass m with semi-axes a_i has second moments m a_i^2 / 5 about its centre.
So the ellipsoid with a body's inertia has semi-axes sqrt(5 s_i / m), s_i the eigenvalues of Sigma
about the centre of mass, along their eigenvectors.

Source: Wensing, Kim & Slotine 2018, section III.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..inertia import pseudo
from ..robot import Robot


@dataclass(frozen=True)
class Solid:
    """An ellipsoid in the base frame: centre (3,) [m], semi-axes (3,) [m], directions (3, 3) in
    columns."""

    centre: np.ndarray
    axes: np.ndarray
    directions: np.ndarray

    def surface(self, across: int = 14) -> tuple[np.ndarray, np.ndarray]:
        """Points (k, 3) [m] and triangles (f, 3) of its surface."""
        around = 2 * across
        polar, turn = (
            np.linspace(0.0, np.pi, across + 1),
            np.linspace(0.0, 2.0 * np.pi, around, endpoint=False),
        )
        p, a = (grid.ravel() for grid in np.meshgrid(polar, turn, indexing="ij"))
        points = self._placed(
            np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], 1)
        )
        row, column = (
            grid.ravel()
            for grid in np.meshgrid(np.arange(across), np.arange(around), indexing="ij")
        )
        here, beside = row * around + column, row * around + (column + 1) % around
        return points, np.concatenate(
            [
                np.stack([here, beside, here + around], 1),
                np.stack([beside, beside + around, here + around], 1),
            ]
        )

    def rings(self, count: int = 40) -> np.ndarray:
        """Its three principal ellipses as one line (k, 3) [m], NaN between them."""
        turn = np.linspace(0.0, 2.0 * np.pi, count)
        rings = []
        for first, second in ((0, 1), (1, 2), (2, 0)):
            ring = np.zeros((count, 3))
            ring[:, first], ring[:, second] = np.cos(turn), np.sin(turn)
            rings += [self._placed(ring), np.full((1, 3), np.nan)]
        return np.concatenate(rings[:-1])

    def _placed(self, points) -> np.ndarray:
        return self.centre + (points * self.axes) @ self.directions.T


def frames(robot: Robot, q) -> list[pin.SE3]:
    """Placement of every joint of the full tree in the base frame, at joint angles q (dof,)."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, robot.transmission @ np.asarray(q, dtype=float))
    return [data.oMi[row + 1].copy() for row in range(len(robot.parents))]


def solids(robot: Robot, pi, placed: list[pin.SE3]) -> list[Solid | None]:
    """The ellipsoid of each body with parameters pi (bodies, 10); None for a body that is not
    physically possible."""
    out: list[Solid | None] = []
    for body, own in zip(robot.bodies, np.asarray(pi, dtype=float)):
        mass = own[0]
        if not np.isfinite(own).all() or mass <= 0:
            out.append(None)
            continue
        centre = own[1:4] / mass
        spread = pseudo.to_pseudo(own)[:3, :3] / mass - np.outer(centre, centre)
        values, vectors = np.linalg.eigh(spread)
        if values[0] < 0:
            out.append(None)
            continue
        frame = placed[body.row]
        out.append(Solid(frame.act(centre), np.sqrt(5.0 * values), frame.rotation @ vectors))
    return out


def skeleton(robot: Robot, placed: list[pin.SE3]) -> list[tuple[np.ndarray, np.ndarray]]:
    """The links as lines, each from one joint's origin to the next's (3,) [m], from the base on.

    A link that carries no further joint ends at its centre of mass in the robot's description:
    without it, that joint's motion could not be seen.
    """
    rows = {body.row for body in robot.bodies if body.kind == "link"}
    origin = lambda row: placed[row].translation if row >= 0 else np.zeros(3)  # noqa: E731
    lines = [(origin(int(robot.parents[row])), origin(row)) for row in sorted(rows)]
    carrying = {int(robot.parents[row]) for row in rows}
    for body, own in zip(robot.bodies, robot.prior):
        if body.kind == "link" and body.row not in carrying and own[0] > 0:
            lines.append((origin(body.row), placed[body.row].act(np.asarray(own[1:4]) / own[0])))
    return lines
