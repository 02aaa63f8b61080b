"""How a robot may be mounted: the directions of gravity in its base that its torques speak for."""

from __future__ import annotations

import numpy as np

from .. import regressor
from .equations import FEWEST, Equations

_NEAR = np.cos(np.radians(25.0))  # nearer to what the experiment says, a tilt of the base is found
# of gravity: torque that has less than a third of it does not tell where it points; one that has
# less than a tenth has none, as of arms that take it off themselves
_LEAST, _NOTHING = 0.3, 0.1
_EARTH = 9.81  # m/s^2


def gravities(equations: Equations) -> list[tuple[float, ...]]:
    """Another direction of gravity (3,) [m/s^2], as large, by which the URDF's bodies explain the
    torques best: along an axis of the base where it is near one. Zero where the torques have
    nothing of gravity; none where they hardly tell.

    What weight they have is linear in it: tau_j = p_j(g = 0) + G_j g + I qdd_j + Fv qd_j
    + Fc sign(qd_j) + b.
    """
    own, best = equations.robot.gravity, _best(equations)
    if best is None:
        return []
    size = float(np.linalg.norm(own)) or _EARTH
    if np.linalg.norm(best) < _NOTHING * size and np.any(own):
        return [(0.0, 0.0, 0.0)]
    if not np.linalg.norm(best) > _LEAST * size:
        return []
    best = size * best / np.linalg.norm(best)
    axes = [sign * size * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    axis = max(axes, key=lambda one: one @ best)
    down = axis if axis @ best > _NEAR * size**2 else best
    return [] if down @ own > _NEAR * size**2 else [tuple(np.round(down, 2) + 0.0)]


def _best(equations: Equations) -> np.ndarray | None:
    """The gravity (3,) [m/s^2] that the torques tell; None where nothing tells."""
    robot, parts = equations.robot, []
    for q, qd, qdd, smoother, rows in equations.pieces:
        still = np.zeros_like(q)
        p = regressor.torque(robot, robot.prior, q, qd, qdd, gravity=np.zeros(3))
        weights = [
            regressor.torque(robot, robot.prior, q, still, still, gravity=axis)
            for axis in np.eye(3)
        ]
        stacked = np.stack([p, *weights, qdd, qd, np.sign(qd), np.ones_like(q)])
        parts.append(smoother.at(np.moveaxis(stacked, 1, 2), rows))
    columns, squares, scores = np.concatenate(parts, axis=2), np.zeros((3, 3)), np.zeros(3)
    for j, use in enumerate(equations.use.T):
        tau = equations.tau[use, j]
        if use.sum() < FEWEST or not np.ptp(tau) > 0.0:
            continue
        p, *rest = columns[:, j, use] / np.std(tau)
        turn, _ = np.linalg.qr(np.array(rest[3:]).T)
        bare = lambda a: a - turn @ (turn.T @ a)  # noqa: E731, B023
        weight, left = bare(np.array(rest[:3]).T), bare(tau / np.std(tau) - p)
        squares += weight.T @ weight
        scores += weight.T @ left
    return np.linalg.lstsq(squares, scores, rcond=1e-6)[0] if squares.any() else None
