"""Robot x motion -> how each frame of its tree moves, for any number of samples at once.

One pass over the tree, parents first, carries for each frame its angular velocity w and acceleration alpha, and the
acceleration a of its origin (gravity included). Arrays keep samples last.

Source: Featherstone 2008, ch. 5 (recursion).
"""

from dataclasses import dataclass

import numpy as np

from .robot import Robot


@dataclass(frozen=True)
class Frame:
    """Motion of a frame of the tree, (3, n) in its own axes; `turn` takes vectors from its parent's axes to its own, `origin`
    (3, 1 or n) is where it stands in these."""

    angular: np.ndarray
    angular_acceleration: np.ndarray
    acceleration: np.ndarray
    turn: "Turn"
    origin: np.ndarray


def frames(robot: Robot, q, qd, qdd, *, gravity=None, deflection=None, bearing=None) -> list[Frame]:
    """Motion of every frame of the tree, parents first. Arguments: see `body_motions`.

    Args:
        bearing: rows of those that are asked for, with all that they hang on; the others are None. All where it is None.
    """
    return frames_of(robot, of_rows(robot, q, qd, qdd, deflection), gravity, bearing)


def of_rows(robot: Robot, q, qd, qdd, deflection) -> list[np.ndarray]:
    """Position, speed and acceleration (rows, n) of every joint of the tree."""
    out = [
        robot.transmission @ np.ascontiguousarray(np.asarray(x, dtype=float).T)
        for x in (q, qd, qdd)
    ]
    if deflection is not None:
        links = [body.row for body in robot.bodies if body.kind == "link"]
        for full, behind in zip(out, deflection):
            full[links] -= behind.T
    return out


def frames_of(
    robot: Robot, stand, gravity, bearing=None, beside: list[Frame] | None = None, turned: int = -1
) -> list[Frame]:
    """`frames` of a tree whose joints `stand` as `of_rows` has it.

    Args:
        beside: frames of the same tree, of which those of rows in `bearing` move otherwise; `turned`: the one of these whose position
            does, -1 for none.
    """
    full_q, full_qd, full_qdd = stand
    n = full_q.shape[1]
    zero = np.zeros((3, n))
    # the base accelerates upward at -g: gravity enters every body at no cost
    base = (
        zero,
        zero,
        np.repeat(-np.asarray(robot.gravity if gravity is None else gravity)[:, None], n, 1),
    )
    out: list[Frame] = []
    for i, parent in enumerate(robot.parents):
        if bearing is not None and i not in bearing:
            out.append(None if beside is None else beside[i])
            continue
        w, alpha, a = (
            (out[parent].angular, out[parent].angular_acceleration, out[parent].acceleration)
            if parent >= 0
            else base
        )
        linear, angular = robot.subspaces[i, :3, None], robot.subspaces[i, 3:, None]
        speed, push = full_qd[i], full_qdd[i]
        revolute = bool(np.any(angular))
        if beside is None or i == turned:
            to_child = (
                _rotation_to_child(robot.rotations[i], robot.subspaces[i], full_q[i])
                if revolute
                else robot.rotations[i].T
            )
            # origin of the child's frame in the parent's axes; a prismatic joint moves it along its axis
            p = robot.translations[i][:, None] + (
                0.0 if revolute else robot.rotations[i] @ (linear * full_q[i])
            )
            turn = Turn(to_child)
        else:
            turn, p = beside[i].turn, beside[i].origin
        new_w, new_alpha = turn(w), turn(alpha)
        # classical acceleration of the child's origin
        new_a = turn(a + cross(alpha, p) + cross(w, cross(w, p)))
        if revolute:
            new_alpha = new_alpha + angular * push + cross(new_w, angular) * speed
            new_w = new_w + angular * speed
        else:
            new_a = new_a + linear * push + 2.0 * cross(new_w, linear) * speed
        out.append(Frame(new_w, new_alpha, new_a, turn, p))
    return out


class Turn:
    """Turns vectors (3, n) by one matrix (3, 3) or by a matrix for each sample (3, 3, n); `back` by its inverse."""

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
        return Turn(np.swapaxes(self.matrix, 0, 1))(vector)


def _rotation_to_child(placement, subspace, angle) -> np.ndarray:
    """(R_placement exp(S(axis) angle))' for every sample: (3, 3, n), by Rodrigues' formula."""
    turned = skew(subspace[3:])
    parts = [placement, placement @ turned, placement @ turned @ turned]
    shares = np.stack([part.T.ravel() for part in parts], axis=1)
    half = np.tan(0.5 * angle)  # sine and cosine of the whole in the time of one of them
    sine = 2.0 * half / (1.0 + half**2)
    return (shares @ np.stack([np.ones_like(half), sine, half * sine])).reshape(3, 3, half.size)


def skew(vector) -> np.ndarray:
    """S (3, 3) with S b = vector x b."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def cross(a, b) -> np.ndarray:
    """a x b (3, n) of (3, 1 or n) each; of a vector that is the same for every sample one product with a matrix."""
    if np.shape(b)[1] == 1:
        return skew(-b[:, 0]) @ a
    if np.shape(a)[1] == 1:
        return skew(a[:, 0]) @ b
    out = np.empty(np.shape(a))
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.multiply(a[i], b[j], out=out[k])
        out[k] -= a[j] * b[i]
    return out


def to_base(robot: Robot, row: int) -> list[int]:
    """A row and those that bear it, the next first."""
    out = []
    while row >= 0:
        out.append(row)
        row = robot.parents[row]
    return out
