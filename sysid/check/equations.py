"""What the URDF's robot makes of measured motion, however its columns are read.

Of each joint the torque that the URDF's bodies need, up to a factor that masses may be wrong by,
with inertia of a motor, viscous and Coulomb friction of the right sign, and a bias:

    tau_j = s p_j(q, qd, qdd) + I qdd_j + Fv qd_j + Fc sign(qd_j) + b
    1/3 <= s <= 3;  I, Fv, Fc >= 0

No parameter of a wrong reading fits as well as those of the right one: columns in another order, a
sign, a unit are readings, and each is scored by the same sum, log of the residual squares.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import regressor
from ..motion import Motion
from ..robot import Robot
from ..rows import Rows, starts

LIKELY = (1.0 / 3.0, 3.0)  # masses of a URDF, over the robot's
FEWEST = 50  # rows by which a joint can be told anything


@dataclass(frozen=True)
class Reading:
    """How columns are read: the joint whose column each joint's angle and torque (dof,) really is,
    their factors (dof,), and the angles [rad] of the URDF at which these read zero; gravity (3,) in
    the base, None for the experiment's. unit: what all angles are in, "" for the experiment's, and
    scale (dof,): what makes rad of these as they are read.
    """

    angle: tuple[int, ...]
    torque: tuple[int, ...]
    angle_factor: tuple[float, ...]
    torque_factor: tuple[float, ...]
    zero: tuple[float, ...]
    gravity: tuple[float, ...] | None = None
    unit: str = ""
    scale: tuple[float, ...] | float = 1.0

    @property
    def turned(self) -> np.ndarray:
        """(dof,) by which what is read as an angle is multiplied."""
        return np.array(self.angle_factor) * np.array(self.scale)

    @staticmethod
    def plain(dof: int) -> Reading:
        """As the experiment says."""
        own, one = tuple(range(dof)), (1.0,) * dof
        return Reading(own, own, one, one, (0.0,) * dof)


@dataclass(frozen=True)
class Scored:
    """Of each joint (dof,): squares left, squares of its torque about its mean, the factor of the
    URDF's torque, the share of squares that this torque takes, squares of the URDF's torque itself
    about its mean, and whether anything is known."""

    left: np.ndarray
    whole: np.ndarray
    factor: np.ndarray
    taken: np.ndarray
    bodies: np.ndarray
    known: np.ndarray

    @property
    def loss(self) -> float:
        """Sum of the logarithms of what is left, of joints that can be told."""
        return float(np.sum(np.log(self.left[self.known])))


@dataclass(frozen=True)
class Equations:
    """Low-passed training motion of a robot, thinned. pieces: (q, qd, qdd (n, dof), smoother, rows)
    of each; tau, use (rows, dof)."""

    robot: Robot
    pieces: tuple
    tau: np.ndarray
    use: np.ndarray

    @staticmethod
    def of(robot: Robot, motion: Motion, stride: int, rows: Rows) -> Equations:
        """Of the rows of a motion that a stride keeps."""
        kept = zip(motion.pieces, starts(motion, stride))
        pieces = tuple((p.q, p.qd, p.qdd, p.smoother, own) for p, own in kept)
        # the torque where another joint's angle would have a row count, too
        return Equations(robot, pieces, rows.of(motion, "tau"), rows.use)

    def scored(self, reading: Reading, *, free: bool = False) -> Scored:
        """What a reading of the columns leaves of each joint's torque.

        Args:
            free: whether the URDF's torque may have any factor.
        """
        own, columns = list(reading.angle), self.columns(reading)
        tau = self.tau[:, list(reading.torque)] * np.array(reading.torque_factor)
        use = self.use[:, own]
        found = [fitted(columns[:, j, use[:, j]], tau[use[:, j], j], free) for j in range(len(own))]
        return Scored(*map(np.array, zip(*found)))

    def columns(self, reading: Reading) -> np.ndarray:
        """(5, dof, rows) of each joint the torque of the URDF's bodies, acceleration, speed, its
        sign and a constant, as a reading has the angles."""
        own, factor = list(reading.angle), reading.turned
        columns = []
        for q, qd, qdd, smoother, rows in self.pieces:
            q, qd, qdd = (a[:, own] * factor for a in (q, qd, qdd))
            q = q + reading.zero
            down = None if reading.gravity is None else np.array(reading.gravity)
            p = regressor.torque(self.robot, self.robot.prior, q, qd, qdd, gravity=down)
            stacked = np.stack([p, qdd, qd, np.sign(qd), np.ones_like(q)])
            columns.append(smoother.at(np.moveaxis(stacked, 1, 2), rows))
        return np.concatenate(columns, axis=2)


def fitted(columns, tau, free: bool) -> tuple[float, float, float, float, float, bool]:
    """Least squares of one joint's torque (n,) by columns (5, n), with their signs and the first
    one's bounds."""
    if len(tau) < FEWEST or not np.ptp(tau) > 0.0:
        return 1.0, 1.0, 1.0, 0.0, 0.0, False
    size = np.sqrt(np.mean(columns**2, axis=1)) + 1e-300
    unit = float(np.std(tau))
    factor = np.linalg.qr(np.column_stack([(columns / size[:, None]).T, tau / unit]), mode="r")
    a, y = np.column_stack([factor[:, :5], -factor[:, 4]]), factor[:, 5]  # a bias has either sign
    least, most = (np.array((0.0, np.inf)) if free else np.array(LIKELY)) * size[0] / unit
    found, left = _nonnegative(a, y - least * a[:, 0])
    own = least + found[0]
    if own > most:
        own, left = most, _nonnegative(a[:, 1:], y - most * a[:, 0])[1]
    alone = _nonnegative(a[:, 1:], y)[1]
    whole = float(np.sum((tau - tau.mean()) ** 2))
    squares = max(left * unit**2, 1e-12 * whole)
    taken = max(alone - left, 0.0) * unit**2 / whole
    bodies = float(np.sum((columns[0] - columns[0].mean()) ** 2))
    return squares, whole, float(own * unit / size[0]), taken, bodies, True


def _nonnegative(a, y) -> tuple[np.ndarray, float]:
    """Coefficients and the squares that they leave."""
    from scipy.optimize import nnls

    found, left = nnls(a, y)
    return found, float(left**2)
