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

_CHUNK = 4096  # samples: the arrays of one body stay in cache


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
            j: (turn(jl + _cross(ja, p)), turn(ja)) for j, (jl, ja) in (jacobians[parent] if parent >= 0 else {}).items()
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


@dataclass(frozen=True)
class Frame:
    """Motion of a frame of the tree, (3, n) in its own axes; `turn` takes vectors from its parent's axes to its own, `origin`
    (3, 1 or n) is where it stands in these."""

    angular: np.ndarray
    angular_acceleration: np.ndarray
    acceleration: np.ndarray
    turn: "_Turn"
    origin: np.ndarray


def frames(robot: Robot, q, qd, qdd, *, gravity=None, deflection=None, bearing=None) -> list[Frame]:
    """Motion of every frame of the tree, parents first. Arguments: see `body_motions`.

    Args:
        bearing: rows of those that are asked for, with all that they hang on; the others are None. All where it is None.
    """
    q, qd, qdd = (np.ascontiguousarray(np.asarray(x, dtype=float).T) for x in (q, qd, qdd))
    n = q.shape[1]
    full_q, full_qd, full_qdd = (robot.transmission @ x for x in (q, qd, qdd))
    if deflection is not None:
        links = [body.row for body in robot.bodies if body.kind == "link"]
        for full, behind in zip((full_q, full_qd, full_qdd), deflection):
            full[links] -= behind.T
    zero = np.zeros((3, n))
    # the base accelerates upward at -g: gravity enters every body at no cost
    base = (zero, zero, np.repeat(-np.asarray(robot.gravity if gravity is None else gravity)[:, None], n, 1))
    out: list[Frame] = []
    for i, parent in enumerate(robot.parents):
        if bearing is not None and i not in bearing:
            out.append(None)
            continue
        w, alpha, a = (out[parent].angular, out[parent].angular_acceleration, out[parent].acceleration) if parent >= 0 else base
        linear, angular = robot.subspaces[i, :3, None], robot.subspaces[i, 3:, None]
        speed, push = full_qd[i], full_qdd[i]
        revolute = bool(np.any(angular))
        to_child = _rotation_to_child(robot.rotations[i], robot.subspaces[i], full_q[i]) if revolute else robot.rotations[i].T
        # origin of the child's frame in the parent's axes; a prismatic joint moves it along its axis
        p = robot.translations[i][:, None] + (0.0 if revolute else robot.rotations[i] @ (linear * full_q[i]))
        turn = _Turn(to_child)
        new_w, new_alpha = turn(w), turn(alpha)
        # classical acceleration of the child's origin
        new_a = turn(a + _cross(alpha, p) + _cross(w, _cross(w, p)))
        if revolute:
            new_alpha = new_alpha + angular * push + _cross(new_w, angular) * speed
            new_w = new_w + angular * speed
        else:
            new_a = new_a + linear * push + 2.0 * _cross(new_w, linear) * speed
        out.append(Frame(new_w, new_alpha, new_a, turn, p))
    return out


class _Turn:
    """Turn vectors (3, n) by one matrix (3, 3) or by a matrix for each sample (3, 3, n); `back` by its inverse."""

    def __init__(self, matrix):
        self.matrix = matrix

    def __call__(self, vector):
        m = self.matrix
        if m.ndim == 2:
            return m @ vector
        out = np.empty((3, m.shape[2]))
        for r in range(3):
            np.multiply(m[r, 0], vector[0], out=out[r])
            out[r] += m[r, 1] * vector[1]
            out[r] += m[r, 2] * vector[2]
        return out

    def back(self, vector):
        """From the child's axes to the parent's."""
        return _Turn(np.swapaxes(self.matrix, 0, 1))(vector)


def _rotation_to_child(placement, subspace, angle) -> np.ndarray:
    """(R_placement exp(S(axis) angle))' for every sample: (3, 3, n), by Rodrigues' formula."""
    skew = _skew(subspace[3:])
    parts = [placement, placement @ skew, placement @ skew @ skew]
    shares = np.stack([part.T.ravel() for part in parts], axis=1)
    half = np.tan(0.5 * angle)  # sine and cosine of the whole in the time of one of them
    sine = 2.0 * half / (1.0 + half**2)
    return (shares @ np.stack([np.ones_like(half), sine, half * sine])).reshape(3, 3, half.size)


def _skew(vector) -> np.ndarray:
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _cross(a, b) -> np.ndarray:
    """a x b (3, n); of a vector that is the same for every sample one product with a matrix."""
    if np.shape(b)[1] == 1:
        return _skew(-b[:, 0]) @ a
    if np.shape(a)[1] == 1:
        return _skew(a[:, 0]) @ b
    out = np.empty(np.shape(a))
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.multiply(a[i], b[j], out=out[k])
        out[k] -= a[j] * b[i]
    return out


def wrench_columns(motion: BodyMotion, linear, angular, out) -> None:
    """Write the ten columns of one body in one joint's torque into out (10, n)."""
    w, alpha, a = motion.angular, motion.angular_acceleration, motion.acceleration
    out[0] = np.einsum("in,in->n", linear, a)
    along, square = np.einsum("in,in->n", linear, w), np.einsum("in,in->n", w, w)
    out[1:4] = _cross(linear, alpha) + w * along - linear * square + _cross(a, angular)
    u = _cross(angular, w)  # angular . (w x I w) = (angular x w) . I w
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


def regressor_chunks(robot: Robot, q, qd, qdd, *, chunk: int = _CHUNK) -> Iterator[np.ndarray]:
    """`regressor` in pieces of at most `chunk` samples, so that memory does not grow with the log."""
    for start in range(0, len(q), chunk):
        part = slice(start, start + chunk)
        yield regressor(robot, q[part], qd[part], qdd[part])


def torque(robot: Robot, pi, q, qd, qdd, *, gravity=None, deflection=None) -> np.ndarray:
    """Inverse dynamics (n, dof) [N m] of bodies pi (bodies, 10), rotors included, friction not. Bodies without mass cost nothing."""
    q, qd, qdd = (np.asarray(x, dtype=float) for x in (q, qd, qdd))
    heavy = [(parameters, body.row) for parameters, body in zip(np.asarray(pi), robot.bodies) if parameters.any()]
    bearing = set()
    for _, row in heavy:
        while row >= 0 and row not in bearing:
            bearing.add(row)
            row = robot.parents[row]
    out = np.zeros((len(q), robot.dof))
    for start in range(0, len(q), _CHUNK):
        part = slice(start, start + _CHUNK)
        behind = None if deflection is None else deflection[:, part]
        found = frames(robot, q[part], qd[part], qdd[part], gravity=gravity, deflection=behind, bearing=bearing)
        wrenches: dict[int, list] = {}  # force and moment about the origin of each frame, all that hangs on it included
        for parameters, row in heavy:
            force, moment = _wrench(parameters, found[row])
            held = wrenches.setdefault(row, [0.0, 0.0])
            held[0], held[1] = held[0] + force, held[1] + moment
        for i in reversed(range(len(found))):  # children before their parents
            if i not in wrenches:
                continue
            force, moment = wrenches[i]
            linear, angular = robot.subspaces[i, :3], robot.subspaces[i, 3:]
            along = linear @ force + angular @ moment
            for j in np.flatnonzero(robot.transmission[i]):
                out[part, j] += robot.transmission[i, j] * along
            if robot.parents[i] >= 0:
                held = wrenches.setdefault(robot.parents[i], [0.0, 0.0])
                force = found[i].turn.back(force)
                held[0], held[1] = held[0] + force, held[1] + found[i].turn.back(moment) + _cross(found[i].origin, force)
    return out


def _wrench(parameters, motion):
    """Force and moment (3, n) about the origin of a body's frame."""
    mass, h = parameters[0], parameters[1:4]
    xx, yy, zz, xy, yz, xz = parameters[4:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    w, alpha, a = motion.angular, motion.angular_acceleration, motion.acceleration
    force = mass * a + w * (h @ w) - h[:, None] * np.einsum("in,in->n", w, w)  # w x (w x h)
    force -= _skew(h) @ alpha
    return force, _skew(h) @ a + inertia @ alpha + _cross(w, inertia @ w)
