"""The hidden effects as pieces of the true robot: what each adds to its bodies, forces, friction, drive or sensors.

Written apart from the identification's `effects`, so that what is to be found comes from outside. The units are those of the
joint: torque [N m], angle [rad]; on a prismatic joint force [N] and position [m].
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin

from ..effect import last_link
from ..inertia import pseudo
from ..robot import Robot

_EVEN = 0.01  # rad/s over which coupled friction changes sign: it is a second contact, whose sticking is not followed
_CONTACT = 2.0 * math.pi * 80.0  # rad/s: what the teeth of a gear with play swing at when they touch
_CONTACT_DAMPING = 0.4
_EDGE = 0.05  # s


class Part:
    """Does nothing. A part overrides the hooks that it needs.

    fine: it needs the fine steps always. uses_load: its `level` looks at the load.
    """

    fine = False
    uses_load = False

    def __init__(self, robot: Robot, joint: int, **values):
        self.j = joint
        vars(self).update(values)

    def has(self, hook: str) -> bool:
        """Whether it overrides a hook."""
        return getattr(type(self), hook) is not getattr(Part, hook)

    def truth(self, truth):
        """Bodies, gravity and friction with this part in them."""
        return truth

    def loosens(self, joint: int) -> bool:
        """Whether the joint's motor and link move apart."""
        return False

    def settle(self, plant) -> None:
        """Once, before anything moves: constant inertia into plant.extra (n, n)."""

    def rest(self, plant) -> None:
        """Once, at the start: where it leaves the links at rest."""

    def force(self, plant) -> None:
        """Each period: a smooth force to overcome, added to plant.g (n,), from plant.xm, vm, t."""

    def level(self, plant, plus: list[float], minus: list[float], v, load) -> None:
        """Each step: the friction level of each joint forward and backward, changed in place."""

    def push(self, plant, r, x, v, dt: float) -> None:
        """Each step: a force that changes within a period, taken from r (n,)."""

    def commit(self, plant, before, dt: float) -> None:
        """After each step: remember."""

    def drive(self, command, duration: float):
        """The torque (dof,) that acts where `command` was asked for."""
        return command

    def read(self, angle: float) -> float:
        """What the encoder reads at an angle."""
        return angle

    def sense(self, tau, period: float):
        """What is logged of the joint's torque tau (n,), sampled every `period`."""
        return tau


class Viscous(Part):
    """Fv qd."""

    def truth(self, truth):
        viscous = truth.viscous.copy()
        viscous[self.j] += self.Fv
        return replace(truth, viscous=viscous)


class Coulomb(Part):
    """Fc sign(qd)."""

    def level(self, plant, plus, minus, v, load):
        plus[self.j] += self.Fc
        minus[self.j] += self.Fc


class AsymmetricCoulomb(Part):
    """Fc + dF/2 forward, Fc - dF/2 backward."""

    def level(self, plant, plus, minus, v, load):
        plus[self.j] += 0.5 * self.dF
        minus[self.j] -= 0.5 * self.dF


class AsymmetricViscous(Part):
    """Fv + dFv/2 forward, Fv - dFv/2 backward."""

    def force(self, plant):
        m = plant.motor[self.j]
        plant.g[m] += 0.5 * self.dFv * abs(plant.vm[m])


class Stribeck(Part):
    """dF exp(-(qd/vs)^2) more Coulomb friction."""

    def level(self, plant, plus, minus, v, load):
        more = self.dF * math.exp(-((v[plant.motor[self.j]] / self.vs) ** 2))
        plus[self.j] += more
        minus[self.j] += more


class QuadraticDrag(Part):
    """c |qd| qd."""

    def force(self, plant):
        m = plant.motor[self.j]
        plant.g[m] += self.c * abs(plant.vm[m]) * plant.vm[m]


class SublinearViscous(Part):
    """Fa |qd|^a more Coulomb friction: its slope at rest is infinite, as a contact's."""

    def level(self, plant, plus, minus, v, load):
        more = self.Fa * abs(v[plant.motor[self.j]]) ** self.a
        plus[self.j] += more
        minus[self.j] += more


class Presliding(Part):
    """Dahl: z' = (qd - |qd| z) / x0, torque F z; and `share` of the Coulomb friction gone."""

    fine = True

    def settle(self, plant):
        self.z = 0.0

    def level(self, plant, plus, minus, v, load):
        plus[self.j] *= 1.0 - self.share
        minus[self.j] *= 1.0 - self.share

    def _after(self, way: float) -> float:
        s = math.copysign(1.0, way)
        return s + (self.z - s) * math.exp(-abs(way) / self.x0)

    def push(self, plant, r, x, v, dt):
        m = plant.motor[self.j]
        r[m] -= self.F * self._after(0.5 * dt * plant.v[m])

    def commit(self, plant, before, dt):
        m = plant.motor[self.j]
        self.z = self._after(0.5 * dt * (before[m] + plant.v[m]))


class LoadFriction(Part):
    """mu |load| more Coulomb friction."""

    uses_load = True

    def level(self, plant, plus, minus, v, load):
        more = self.mu * abs(load[self.j])
        plus[self.j] += more
        minus[self.j] += more


class DirectionalEfficiency(Part):
    """e load more torque while the joint drives its load: friction forward under a positive load, backward under a negative."""

    uses_load = True

    def level(self, plant, plus, minus, v, load):
        plus[self.j] += self.e * max(load[self.j], 0.0)
        minus[self.j] += self.e * max(-load[self.j], 0.0)


class PositionFriction(Part):
    """sum a_k cos kq + b_k sin kq more Coulomb friction, none of it below zero. `waves`: [(k, a_k, b_k)]."""

    def level(self, plant, plus, minus, v, load):
        q = plant.xm[plant.motor[self.j]]
        more = sum(a * math.cos(k * q) + b * math.sin(k * q) for k, a, b in self.waves)
        plus[self.j] = max(plus[self.j] + more, 0.0)
        minus[self.j] = max(minus[self.j] + more, 0.0)


class Warmup(Part):
    """Coulomb and viscous friction times 1 + a exp(-t/T)."""

    def _more(self, t: float) -> float:
        return self.a * math.exp(-max(t, 0.0) / self.T)

    def force(self, plant):
        m = plant.motor[self.j]
        plant.g[m] += self._more(plant.t) * plant.viscous[m] * plant.vm[m]

    def level(self, plant, plus, minus, v, load):
        factor = 1.0 + self._more(plant.t)
        plus[self.j] *= factor
        minus[self.j] *= factor


class Armature(Part):
    """Ia qdd."""

    def settle(self, plant):
        m = plant.motor[self.j]
        plant.extra[m, m] += self.Ia


class JointCoupling(Part):
    """Ia qdd_i + Fv qd_i + Fs sign(qd_i + qd_j) + Fd sign(qd_i - qd_j) in the equation of joint j; `i` the other joint."""

    def settle(self, plant):
        plant.extra[plant.motor[self.j], plant.motor[self.i]] += self.Ia

    def force(self, plant):
        vj, vi = plant.vm[plant.motor[self.j]], plant.vm[plant.motor[self.i]]
        together = self.Fs * math.tanh((vi + vj) / _EVEN) + self.Fd * math.tanh((vi - vj) / _EVEN)
        plant.g[plant.motor[self.j]] += self.Fv * vi + together


class Elasticity(Part):
    """Motor and link apart, K (theta - q) + D (theta' - q') between them."""

    fine = True

    def loosens(self, joint):
        return joint == self.j

    def rest(self, plant):
        plant.x[self.j] -= plant.h[self.j] / self.K

    def push(self, plant, r, x, v, dt):
        j, m = self.j, plant.motor[self.j]
        torque = self.K * (x[m] - x[j]) + self.D * (v[m] - v[j])
        r[m] -= torque
        r[j] += torque


class Backlash(Part):
    """Motor and link apart by up to b/2 to either side, then teeth that touch: stiff, damped, and never pulling."""

    fine = True

    def loosens(self, joint):
        return joint == self.j

    def rest(self, plant):
        j, m = self.j, plant.motor[self.j]
        link, motor = plant.M[j, j], plant.M[m, m]
        reduced = link * motor / (link + motor)
        self.K, self.D = _CONTACT**2 * reduced, 2.0 * _CONTACT_DAMPING * _CONTACT * reduced
        plant.x[j] -= plant.h[j] / self.K + 0.5 * self.b * np.sign(plant.h[j])

    def push(self, plant, r, x, v, dt):
        j, m = self.j, plant.motor[self.j]
        apart = x[m] - x[j]
        deep = apart - 0.5 * self.b if apart > 0.0 else apart + 0.5 * self.b
        if deep * apart <= 0.0:
            return
        torque = self.K * deep + self.D * (v[m] - v[j])
        if torque * apart > 0.0:
            r[m] -= torque
            r[j] += torque


class Cogging(Part):
    """a sin(k q + phase)."""

    def force(self, plant):
        m = plant.motor[self.j]
        plant.g[m] += self.a * math.sin(self.k * plant.xm[m] + self.phase)


class Spring(Part):
    """k (q - q0)."""

    def force(self, plant):
        plant.g[self.j] += self.k * (plant.xm[self.j] - self.q0)


class Cable(Part):
    """sum c_k (q/pi)^k. `c`: [c1, c2, ...]."""

    def force(self, plant):
        x = plant.xm[self.j] / math.pi
        plant.g[self.j] += sum(c * x ** (k + 1) for k, c in enumerate(self.c))


class GravityTilt(Part):
    """Gravity R' g, R the base turned by roll about x, then by pitch about y: it is not level."""

    def truth(self, truth):
        cr, sr, cp, sp = math.cos(self.roll), math.sin(self.roll), math.cos(self.pitch), math.sin(self.pitch)
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
        about_y = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
        return replace(truth, gravity=(about_y @ about_x).T @ truth.gravity)


class Payload(Part):
    """A box of mass m on the last link. `body`: its number; `box`: its ten parameters."""

    def truth(self, truth):
        return truth.with_payload(self.body, self.box)


class ExternalForce(Part):
    """A constant force (3,) [N] of the base frame that the last link presses with, at its frame's origin, while start <= t <= stop,
    with cosine edges of 0.05 s inside. `bursts`: [(start, stop, force)]."""

    def force(self, plant):
        for start, stop, force in self.bursts:
            inside = min(plant.t - start, stop - plant.t)
            if inside > 0.0:
                joint, edge = self.row + 1, min(_EDGE, 0.25 * (stop - start))
                jacobian = pin.computeJointJacobian(plant.model, plant.data, plant.tree, joint)
                pin.forwardKinematics(plant.model, plant.data, plant.tree)
                share = 0.5 - 0.5 * math.cos(math.pi * min(inside / edge, 1.0))
                plant.g += share * (plant.G.T @ jacobian[:3].T @ (plant.data.oMi[joint].rotation.T @ force))


class CurrentLag(Part):
    """The motor's torque follows what is asked for and logged through a first-order lag T."""

    def settle(self, plant):
        self.y = None

    def drive(self, command, duration):
        asked = float(command[self.j])
        if self.y is None:
            self.y = asked
        gone = math.exp(-duration / self.T)
        command = command.copy()
        command[self.j] = asked + (self.y - asked) * (1.0 - gone) * self.T / duration
        self.y = asked + (self.y - asked) * gone
        return command


class Delay(Part):
    """Torque is logged d seconds late."""

    def sense(self, tau, period):
        t = period * np.arange(len(tau))
        return np.interp(t - self.d, t, tau)


class TorqueGain(Part):
    """(1 + e) times the torque is logged."""

    def sense(self, tau, period):
        return (1.0 + self.e) * tau


class TorqueSaturation(Part):
    """Torque beyond the limit reads flat. (`reports: actual`)"""

    def sense(self, tau, period):
        return np.clip(tau, -self.limit, self.limit)


class SaturatedDrive(Part):
    """No torque beyond the limit acts, and what was asked for is logged. (`reports: command`)"""

    def drive(self, command, duration):
        command = command.copy()
        command[self.j] = min(max(float(command[self.j]), -self.limit), self.limit)
        return command


class TorqueBias(Part):
    """b more is logged."""

    def sense(self, tau, period):
        return tau + self.b


class EncoderOffset(Part):
    """The true angle is the logged one plus d."""

    def read(self, angle):
        return angle - self.d


class EncoderEccentricity(Part):
    """The true angle is the logged one plus d sin(logged + phi)."""

    def read(self, angle):
        logged = angle
        for _ in range(12):  # a contraction by d each time
            logged = angle - self.d * math.sin(logged + self.phi)
        return logged


class Custom(Part):
    """Any torque to overcome, from outside: torque(q, qd, qdd, t, load, memory) -> (dof,), once a control period."""

    def settle(self, plant):
        self.memory = {}

    def force(self, plant):
        motor = plant.motor
        torque = self.torque(plant.xm[motor], plant.vm[motor], plant.a[motor], plant.t, plant.load(plant.a), self.memory)
        plant.g[motor] += np.asarray(torque, dtype=float)


#: parts in the order that they apply in: what scales friction first, the sensor's bias last
PARTS: dict[str, Callable[..., Part]] = {
    "viscous": Viscous, "coulomb": Coulomb, "warmup": Warmup, "presliding": Presliding, "asymmetric_coulomb": AsymmetricCoulomb,
    "asymmetric_viscous": AsymmetricViscous, "stribeck": Stribeck, "quadratic_drag": QuadraticDrag,
    "sublinear_viscous": SublinearViscous, "load_friction": LoadFriction, "directional_efficiency": DirectionalEfficiency,
    "position_friction": PositionFriction, "armature": Armature, "joint_coupling": JointCoupling, "elasticity": Elasticity,
    "backlash": Backlash, "cogging": Cogging, "spring": Spring, "cable": Cable, "gravity_tilt": GravityTilt, "payload": Payload,
    "external_force": ExternalForce, "current_lag": CurrentLag, "torque_gain": TorqueGain, "torque_saturation": TorqueSaturation,
    "delay": Delay, "torque_bias": TorqueBias, "encoder_offset": EncoderOffset, "encoder_eccentricity": EncoderEccentricity,
}  # fmt: skip


def build(robot: Robot, hidden, bursts) -> list[Part]:
    """The parts of the settled effects `hidden` for one log, in their order; `bursts` of the external force in this log."""
    out = []
    for hide in sorted(hidden, key=lambda h: list(PARTS).index(h.effect)):
        joint = robot.joints.index(hide.joint) if hide.joint != "*" else -1
        values = dict(hide.values)
        if hide.effect == "position_friction":
            orders = sorted({int(name[1:]) for name in values})
            values = {"waves": [(k, values.get(f"a{k}", 0.0), values.get(f"b{k}", 0.0)) for k in orders]}
        elif hide.effect == "cable":
            values = {"c": [values[f"c{k}"] for k in range(1, 6)]}
        elif hide.effect == "joint_coupling":
            values["i"] = robot.joints.index(values.pop("other"))
        elif hide.effect == "payload":
            box = pseudo.box(values["m"], [values[key] for key in "xyz"], [values[f"l{key}"] for key in "xyz"])
            values = {"body": last_link(robot), "box": box}
        elif hide.effect == "external_force":
            values = {"row": robot.bodies[last_link(robot)].row, "bursts": bursts}
        kind = PARTS[hide.effect]
        if hide.effect == "torque_saturation" and values.pop("reports", "actual") == "command":
            kind = SaturatedDrive
        out.append(kind(robot, joint, **values))
    return out


def limits(inside: list[Part], dof: int) -> np.ndarray | None:
    """The most torque (dof,) that drives let act; None where none of them saturates."""
    own = [part for part in inside if isinstance(part, SaturatedDrive)]
    out = np.full(dof, np.inf)
    for part in own:
        out[part.j] = part.limit
    return out if own else None
