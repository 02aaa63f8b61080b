"""The controller of a simulated robot, and the loop in time.

Timing. The command computed from the reading at t_k acts from t_k + T/2 to t_k + 3T/2: the encoder is read in the middle of
each hold, as drives that sample in step with their PWM do. Torque and angle logged at t_k then belong to one instant, up
to T^2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import SysidError
from . import motion
from .plant import Plant

STRIDE = 10  # control periods between mass matrices of the controller
KNOWN = 0.8  # share of friction and motor inertia that the controller knows
_BANDWIDTH, _SOFT, _DAMPING = 10.0, 6.0, 0.9  # rad/s of a joint's loop, and of one whose drive is not rigid; its damping
STIFF = 5.0  # times a joint's torque over its reach: the least stiffness, where a light hand would give way to its weight
_STIFFEST = 3.0  # times the bandwidth that this may come to
_RESET = 0.5  # s of the integral
_SMOOTHING = 10e-3  # s over which the controller's speed is smoothed
_ASTRAY = 0.8  # of 0.2 rad and the range that a joint moves to either side: farther from its reference it is out of control


@dataclass(frozen=True)
class Loop:
    """The controller: computed torque `ahead` (n, dof) of the prior along the reference, and a PID law through the prior's
    mass matrices (one every STRIDE periods), at least `stiffness` (dof,) strong. Where `closed` (n, dof), a joint is braked,
    and its integral waits, as it does while more is asked for than the drive's `limits` (dof,) let act."""

    reference: motion.Reference
    ahead: np.ndarray
    masses: np.ndarray
    stiffness: np.ndarray
    period: float
    closed: np.ndarray | None = None
    limits: np.ndarray | None = None

    def gains(self, plant: Plant) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness and damping matrices (n/STRIDE, dof, dof)."""
        own = self.masses.diagonal(axis1=1, axis2=2).mean(axis=0)
        omega = np.array([_BANDWIDTH if m == j else _SOFT for j, m in enumerate(plant.motor)])
        more = np.maximum(np.minimum(self.stiffness, (_STIFFEST * omega) ** 2 * own) - omega**2 * own, 0.0)
        kp = self.masses * omega**2 + np.diag(more)
        kd = 2.0 * _DAMPING * (self.masses * omega + np.diag(np.sqrt(more * own)))
        return kp, kd


def run(plant: Plant, inside, loop: Loop, steps, report):
    """x, v (n, coordinates), torque asked for, readings and sticking (n, dof) at every control period."""
    reference, period, closed, limits = loop.reference, loop.period, loop.closed, loop.limits
    n, dof, motor = len(reference.t), plant.dof, plant.motor
    x, v, tau = np.zeros((n, plant.n)), np.zeros((n, plant.n)), np.zeros((n, dof))
    read, sticks = np.zeros((n, dof)), np.zeros((n, dof), dtype=bool)
    readers = [part for part in inside if part.has("read")]
    fine = np.where(steps > 0.0, steps, 1.0)
    exact = not np.any(steps > 0.0)
    rounded = steps > 0.0
    kp, kd = loop.gains(plant)
    forget = min(1.0, period / _SMOOTHING)
    middle = 0.5 * (reference.q.max(axis=0) + reference.q.min(axis=0))
    room = _ASTRAY * (0.2 + np.abs(reference.q - middle).max(axis=0))

    def look():
        angle = plant.x[motor] if plant.n > dof else plant.x
        if readers:
            angle = angle.copy()
            for part in readers:
                angle[part.j] = part.read(float(angle[part.j]))
        if exact:
            return angle
        return np.where(rounded, np.rint(angle / fine) * fine, angle)

    last, speed, total, command, half = look(), np.zeros(dof), np.zeros(dof), loop.ahead[0], 0.5 * period
    for k in range(n):
        now = look()
        x[k], v[k], tau[k], read[k] = plant.x, plant.v, command, now
        sticks[k] = [s == 0 for s in plant.sign]
        speed = speed + forget * ((now - last) / period - speed)
        last = now
        wrong = reference.q[k] - now
        soon = min(k + 1, n - 1)
        more = wrong if closed is None else np.where(closed[k], 0.0, wrong)
        if limits is not None:
            more = np.where(np.abs(command) > limits, 0.0, more)
        total = total + (period / _RESET) * more
        following = loop.ahead[soon] + kp[k // STRIDE].dot(wrong + total) + kd[k // STRIDE].dot(reference.qd[k] - speed)
        plant.freeze(reference.t[k] + half, half)
        plant.advance(command, half)
        plant.advance(following, half)
        command = following
        if k % 200 == 0:
            astray = ~(np.abs(wrong) < room)
            if astray.any():
                j = int(np.flatnonzero(astray)[0])
                raise SysidError(
                    f"the simulated joint {j + 1} of {dof} is {abs(wrong[j]):.3g} from its reference at t = {reference.t[k]:.2f} s",
                    allowed=f"{room[j]:.3g}", do="lower --speed, or hide less",
                )  # fmt: skip
            if report is not None:
                report((k + 1) / n)
    return x, v, tau, read, sticks
