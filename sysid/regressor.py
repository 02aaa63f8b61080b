"""Robot x motion -> the columns that multiply inertial parameters, exact, for any number of samples at once.

One pass over the tree, parents first, carries for each body its angular velocity w and acceleration alpha, the
acceleration a of its frame's origin (gravity included), and the columns J of its body Jacobian with respect to the joint
speeds (which already hold the transmission: J_i = X J_parent + S_i G_i). A body's force and moment about its
origin are linear in its ten parameters,

    f = m a + alpha x h + w x (w x h)
    n = h x a + I alpha + w x (I w)

and its share of the torque of joint j is J_j . (f, n). Arrays keep samples last, so that each column is one
contiguous run of memory, as LAPACK wants them.

Source: Atkeson, An & Hollerbach 1986; Featherstone 2008, ch. 5 (recursion).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .robot import Robot
from .tree import cross, frames, skew, to_base

CHUNK = 4096  # samples: the arrays of one body stay in cache


@dataclass(frozen=True)
class BodyMotion:
    """Motion of one body's frame: w, alpha, a (3, n) in its own axes; jacobian {joint: (linear, angular)}."""

    angular: np.ndarray
    angular_acceleration: np.ndarray
    acceleration: np.ndarray
    jacobian: dict[int, tuple[np.ndarray, np.ndarray]]


def body_motions(robot: Robot, q, qd, qdd, *, gravity=None, deflection=None) -> list[BodyMotion]:
    """Motion of every body, in the order of `robot.bodies`.

    Args:
        q, qd, qdd: (n, dof).
        gravity: (3,) [m/s^2] in the base frame, where it is not the robot's own.
        deflection: (3, n, dof) or None: how far q, qd and qdd of each joint's link stand behind those of its motor.
    """
    found = frames(robot, q, qd, qdd, gravity=gravity, deflection=deflection)
    zero = np.zeros((3, found[0].angular.shape[1]))
    jacobians: list[dict] = []
    for i, (parent, frame) in enumerate(zip(robot.parents, found)):
        linear, angular = robot.subspaces[i, :3, None], robot.subspaces[i, 3:, None]
        turn, p = frame.turn, frame.origin
        carried = {
            j: (turn(jl + cross(ja, p)), turn(ja)) for j, (jl, ja) in (jacobians[parent] if parent >= 0 else {}).items()
        }
        for j in np.flatnonzero(robot.transmission[i]):
            gain = robot.transmission[i, j]
            jl, ja = carried.get(j, (0.0, 0.0))
            carried[j] = (jl + gain * linear + zero, ja + gain * angular + zero)
        jacobians.append(carried)
    return [
        BodyMotion(found[b.row].angular, found[b.row].angular_acceleration, found[b.row].acceleration, jacobians[b.row])
        for b in robot.bodies
    ]


def wrench_columns(motion: BodyMotion, linear, angular, out) -> None:
    """Write the ten columns of one body in one joint's torque into out (10, n)."""
    w, alpha, a = motion.angular, motion.angular_acceleration, motion.acceleration
    out[0] = np.einsum("in,in->n", linear, a)
    along, square = np.einsum("in,in->n", linear, w), np.einsum("in,in->n", w, w)
    out[1:4] = cross(linear, alpha) + w * along - linear * square + cross(a, angular)
    u = cross(angular, w)  # angular . (w x I w) = (angular x w) . I w
    out[4:7] = angular * alpha + u * w
    for k, (i, j) in zip((7, 8, 9), ((0, 1), (1, 2), (0, 2))):
        out[k] = angular[i] * alpha[j] + angular[j] * alpha[i] + u[i] * w[j] + u[j] * w[i]


def columns(robot: Robot, q, qd, qdd, **how) -> np.ndarray:
    """The regressor with samples last, (dof, 10 bodies, n); the layout that compression works on. `how`: see `body_motions`."""
    motions = body_motions(robot, q, qd, qdd, **how)
    out = np.zeros((robot.dof, 10 * len(motions), np.shape(q)[0]))
    for b, motion in enumerate(motions):
        for j, (linear, angular) in motion.jacobian.items():
            wrench_columns(motion, linear, angular, out[j, 10 * b : 10 * b + 10])
    return out


def by_joint(robot: Robot, q, qd, qdd, *, room=None, **how) -> list[np.ndarray]:
    """Of each joint, the columns (10 bodies that move with it, n) of the regressor, without those that are zero whatever the motion.

    Args:
        room: (dof,) how many rows to leave at the end of each for other columns. how: see `body_motions`.
    """
    motions = body_motions(robot, q, qd, qdd, **how)
    moved = [sum(j in motion.jacobian for motion in motions) for j in range(robot.dof)]
    spare = [0] * robot.dof if room is None else room
    out = [np.empty((10 * count + more, np.shape(q)[0])) for count, more in zip(moved, spare)]
    at = [0] * robot.dof
    for motion in motions:
        for j, (linear, angular) in motion.jacobian.items():
            wrench_columns(motion, linear, angular, out[j][at[j] : at[j] + 10])
            at[j] += 10
    return out


def regressor(robot: Robot, q, qd, qdd) -> np.ndarray:
    """Y (n, dof, 10 bodies) with torque = Y @ pi.ravel(), pi (bodies, 10) about the joints' frames.

    Args:
        q, qd, qdd: (n, dof) positions [rad or m], velocities, accelerations.
    """
    return np.moveaxis(columns(robot, q, qd, qdd), -1, 0)


def regressor_chunks(robot: Robot, q, qd, qdd, *, chunk: int = CHUNK) -> Iterator[np.ndarray]:
    """`regressor` in pieces of at most `chunk` samples, so that memory does not grow with the log."""
    for start in range(0, len(q), chunk):
        part = slice(start, start + chunk)
        yield regressor(robot, q[part], qd[part], qdd[part])


def torque(robot: Robot, pi, q, qd, qdd, *, gravity=None, deflection=None) -> np.ndarray:
    """Inverse dynamics (n, dof) [N m] of bodies pi (bodies, 10), rotors included, friction not. Bodies without mass cost nothing."""
    q, qd, qdd = (np.asarray(x, dtype=float) for x in (q, qd, qdd))
    heavy, bearing = heavy_of(robot, pi)
    rows, out = range(len(robot.parents))[::-1], np.zeros((len(q), robot.dof))
    for start in range(0, len(q), CHUNK):
        part = slice(start, start + CHUNK)
        behind = None if deflection is None else deflection[:, part]
        found = frames(robot, q[part], qd[part], qdd[part], gravity=gravity, deflection=behind, bearing=bearing)
        handed_down(robot, found, rows, wrenches(heavy, found), out[part].T)
    return out


def heavy_of(robot: Robot, pi) -> tuple[list[tuple[np.ndarray, int]], set[int]]:
    """The parameters of bodies that have some, each with its row; and these rows with all that bear them."""
    heavy = [(parameters, body.row) for parameters, body in zip(np.asarray(pi), robot.bodies) if parameters.any()]
    return heavy, {i for _, row in heavy for i in to_base(robot, row)}


def wrenches(heavy, found) -> dict[int, list]:
    """{row: force and moment (3, n) of the bodies of a frame about its origin}."""
    out: dict[int, list] = {}
    for parameters, row in heavy:
        force, moment = _wrench(parameters, found[row])
        held = out.setdefault(row, [0.0, 0.0])
        held[0], held[1] = held[0] + force, held[1] + moment
    return out


def handed_down(robot: Robot, found, rows, held_by: dict[int, list], out: np.ndarray) -> None:
    """Add to torque (dof, n) what holds the wrenches of frames, each handed on to the frame that bears it.

    Args:
        rows: of the tree, children before their parents. held_by: as of `wrenches`; changed.
    """
    for i in rows:
        if i not in held_by:
            continue
        force, moment = held_by[i]
        linear, angular = robot.subspaces[i, :3], robot.subspaces[i, 3:]
        along = linear @ force + angular @ moment
        for j in np.flatnonzero(robot.transmission[i]):
            out[j] += robot.transmission[i, j] * along
        if robot.parents[i] >= 0:
            held = held_by.setdefault(robot.parents[i], [0.0, 0.0])
            force = found[i].turn.back(force)
            held[0], held[1] = held[0] + force, held[1] + found[i].turn.back(moment) + cross(found[i].origin, force)


def _wrench(parameters, motion):
    """Force and moment (3, n) about the origin of a body's frame."""
    mass, h = parameters[0], parameters[1:4]
    xx, yy, zz, xy, yz, xz = parameters[4:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    w, alpha, a = motion.angular, motion.angular_acceleration, motion.acceleration
    force = mass * a + w * (h @ w) - h[:, None] * np.einsum("in,in->n", w, w)  # w x (w x h)
    force -= skew(h) @ alpha
    return force, skew(h) @ a + inertia @ alpha + cross(w, inertia @ w)
