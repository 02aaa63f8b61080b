"""What weights of the bodies' columns add up to, and how that changes with the motion.

    s_j = sum_p weight_jp c_jp(q, qd, qdd)

is the torque of joint j of bodies whose parameters are the weights, others at every instant and for every joint.
The slopes of sum_j s_j come from one pass over the tree, children first, which turns the recursion of
`sysid.regressor` about: what the sum gains for a frame's motion and Jacobian is handed to its
parent. A vector u that a joint turns changes by u x axis with the joint's angle.

Source: Griewank & Walther 2008, ch. 3 (reverse accumulation).
"""

from __future__ import annotations

import numpy as np

from .. import tree
from ..robot import Robot


def summed(robot: Robot, weights, q, qd, qdd) -> tuple[np.ndarray, np.ndarray]:
    """s (dof, n) of samples (n, dof), and the slopes (3, dof, n) of its sum over the joints in q, qd and
    qdd.

    Args:
        weights (dof, 10 bodies, n): of columns.
    """
    frames = tree.frames(robot, q, qd, qdd)
    jacobians = _jacobians(robot, frames)
    s, out = np.zeros((robot.dof, len(q))), np.zeros((3, len(frames), len(q)))
    gains = [_Gains(len(q), len(joints)) for joints, *_ in jacobians]
    for b, body in enumerate(robot.bodies):
        joints, _, linear, angular = jacobians[body.row]
        own = weights[joints, 10 * b : 10 * b + 10]
        s[joints] += gains[body.row].of_body(own, frames[body.row], linear, angular)
    speeds, pushes = (robot.transmission @ np.transpose(rate) for rate in (qd, qdd))
    for i in reversed(range(len(frames))):
        parent = robot.parents[i]
        above = frames[parent] if parent >= 0 else None
        out[:, i] = gains[i].of_joint(
            robot, i, frames[i], above, jacobians[i][1], speeds[i], pushes[i]
        )
        if above is not None:
            gains[parent].handed(gains[i], frames[i], above)
    return s, np.einsum("rin,ij->rjn", out, robot.transmission)


def _jacobians(robot: Robot, frames) -> list[tuple]:
    """Of each frame: the joints (J,) that move it, those of its parent first; the Jacobian that it has of
    its parent, linear and angular (3, parent's J, n) each; the whole of it, linear and angular (3, J, n)."""
    out: list[tuple] = []
    n = frames[0].angular.shape[1]
    for i, frame in enumerate(frames):
        parent = robot.parents[i]
        joints, linear, angular = np.zeros(0, dtype=int), np.zeros((3, 0, n)), np.zeros((3, 0, n))
        if parent >= 0:
            joints, _, linear, angular = out[parent]
            p = _spread(frame.origin)
            linear, angular = _turn(frame, linear + _cross(angular, p)), _turn(frame, angular)
        carried = linear, angular
        new = np.setdiff1d(np.flatnonzero(robot.transmission[i]), joints)
        joints = np.concatenate([joints, new])
        linear, angular = (np.concatenate([v, np.zeros((3, len(new), n))], axis=1) for v in carried)
        axis = robot.transmission[i, joints][None, :, None] * robot.subspaces[i][:, None, None]
        out.append((joints, carried, linear + axis[:3], angular + axis[3:]))
    return out


class _Gains:
    """What the sum gains for w, alpha and a of a frame (3, n), and for its Jacobian, linear and angular
    (3, J, n)."""

    def __init__(self, n: int, joints: int):
        self.w, self.alpha, self.a = np.zeros((3, 3, n))
        self.linear, self.angular = np.zeros((2, 3, joints, n))

    def of_body(self, weights, frame, linear, angular) -> np.ndarray:
        """Add those of a body with parameters (J, 10, n); its share of s (J, n)."""
        m, h, turned = weights[:, 0], np.moveaxis(weights[:, 1:4], 1, 0), _inertia(weights)
        w, alpha, a = (
            _spread(v) for v in (frame.angular, frame.angular_acceleration, frame.acceleration)
        )
        wh, iw = _cross(w, h), turned(w)
        force = m * a + _cross(alpha, h) + _cross(w, wh)
        moment = _cross(h, a) + turned(alpha) + _cross(w, iw)
        self.linear += force
        self.angular += moment
        self.a += (m * linear + _cross(angular, h)).sum(axis=1)
        self.alpha += (_cross(h, linear) + turned(angular)).sum(axis=1)
        told = _cross(wh, linear) + _cross(h, _cross(linear, w))
        self.w += (told + _cross(iw, angular) + turned(_cross(angular, w))).sum(axis=1)
        return (linear * force + angular * moment).sum(axis=0)

    def of_joint(self, robot, i: int, frame, above, carried, speed, push) -> np.ndarray:
        """Slopes (3, n) in q, qd and qdd of a frame's own joint; what is left is for what was turned
        into the frame's axes, without what the joint itself adds."""
        linear, angular = robot.subspaces[i, :3, None], robot.subspaces[i, 3:, None]
        count = carried[0].shape[1]
        self.linear, self.angular = self.linear[:, :count], self.angular[:, :count]
        if not angular.any():  # it slides
            out = self._of_slide(robot, i, frame, above, linear, carried)
            self.w = self.w + 2.0 * _cross(linear * speed, self.a)
            return out
        before = frame.angular - angular * speed
        gyroscopic = _cross(before, angular)
        of_speed = _dot(angular, self.w) + _dot(gyroscopic, self.alpha)
        of_push = _dot(angular, self.alpha)
        self.w = self.w + _cross(angular * speed, self.alpha)
        alpha = frame.angular_acceleration - angular * push - gyroscopic * speed
        twist = _cross(self.w, before) + _cross(self.alpha, alpha)
        twist += _cross(self.a, frame.acceleration)
        for gain, own in zip((self.linear, self.angular), carried):
            twist += _cross(gain, own).sum(axis=1)
        return np.stack([_dot(angular, twist), of_speed, of_push])

    def _of_slide(self, robot, i, frame, above, linear, carried) -> np.ndarray:
        """Slopes of a joint that slides."""
        way = robot.rotations[i] @ linear  # in the parent's axes
        of_speed, of_push = 2.0 * _dot(_cross(frame.angular, linear), self.a), _dot(linear, self.a)
        if above is None:  # the base stands still
            return np.stack([0.0 * of_push, of_speed, of_push])
        w, back = above.angular, frame.turn.back(self.a)
        moved = _cross(above.angular_acceleration, way) + _cross(w, _cross(w, way))
        of_angle = _dot(moved, back) + (_cross(carried[1], _spread(linear)) * self.linear).sum(
            axis=(0, 1)
        )
        return np.stack([of_angle, of_speed, of_push])

    def handed(self, child: _Gains, frame, above) -> None:
        """Add what a child's are worth, in the axes of this frame."""
        p, w, back = frame.origin, above.angular, frame.turn.back
        a = back(child.a)
        self.a += a
        self.alpha += back(child.alpha) + _cross(p, a)
        self.w += back(child.w) + _cross(_cross(w, p), a) + _cross(p, _cross(a, w))
        linear = _turn(frame, child.linear, back=True)
        self.linear += linear
        self.angular += _turn(frame, child.angular, back=True) + _cross(_spread(p), linear)


def _inertia(weights):
    """v (3, J or 1, n) -> I v (3, J, n) of parameters (J, 10, n)."""
    xx, yy, zz, xy, yz, xz = np.moveaxis(weights[:, 4:], 1, 0)
    return lambda v: np.stack([
        xx * v[0] + xy * v[1] + xz * v[2], xy * v[0] + yy * v[1] + yz * v[2],
        xz * v[0] + yz * v[1] + zz * v[2],
    ])  # fmt: skip


def _turn(frame, vectors, back: bool = False) -> np.ndarray:
    """Vectors (3, J, n) of the parent's axes in a frame's; the other way about where it is `back`."""
    m = np.swapaxes(frame.turn.matrix, 0, 1) if back else frame.turn.matrix
    return np.stack(
        [m[r, 0] * vectors[0] + m[r, 1] * vectors[1] + m[r, 2] * vectors[2] for r in range(3)]
    )


def _spread(vector) -> np.ndarray:
    """(3, n) or (3, 1) beside vectors (3, J, n)."""
    return vector[:, None]


def _cross(a, b) -> np.ndarray:
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.multiply(a[i], b[j], out=out[k])
        out[k] -= a[j] * b[i]
    return out


def _dot(a, b) -> np.ndarray:
    return (a * b).sum(axis=0)
