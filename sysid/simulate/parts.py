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
from .friction_parts import (
    AsymmetricCoulomb,
    AsymmetricViscous,
    Coulomb,
    DirectionalEfficiency,
    JointCoupling,
    LoadFriction,
    PositionFriction,
    Presliding,
    QuadraticDrag,
    Stribeck,
    SublinearViscous,
    Viscous,
    Warmup,
)
from .measuring_parts import CurrentLag, Delay, EncoderEccentricity, EncoderOffset, SaturatedDrive, TorqueBias, TorqueGain, TorqueSaturation
from .part import Part
from .transmission_parts import Backlash, Elasticity

_EDGE = 0.05  # s


class Armature(Part):
    """Ia qdd."""

    def settle(self, plant):
        m = plant.motor[self.j]
        plant.extra[m, m] += self.Ia


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
                jacobian = jacobian.reshape(6, -1)  # of one joint it comes flat
                pin.forwardKinematics(plant.model, plant.data, plant.tree)
                share = 0.5 - 0.5 * math.cos(math.pi * min(inside / edge, 1.0))
                plant.g += share * (plant.G.T @ jacobian[:3].T @ (plant.data.oMi[joint].rotation.T @ force))


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
