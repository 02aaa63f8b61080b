"""A model -> what a simulator's robot description can say of it: bodies, and a few numbers a joint.

A simulator knows rigid links and, of each joint, some of: damping, drag, friction, breakaway,
armature, stiffness, zero. What an effect is among these stands in the effect's own file,
`Effect.simulators`; what a format knows, in the format's.

A rotor that turns N times as fast as its joint, with the moment of inertia I about its axis, is
said as three things: its mass and what is left of its inertia ride on the link that carries it,
and the joint has the armature N^2 I. What is lost is the carrier's own turning: with x the
carrier's speed about the axis and y the joint's, the rotor's energy is I/2 (x + N y)^2, and
armature alone has no x y. Where the axis is the joint's and the carrier the joint's parent, this
is also

    I/2 x^2 - N I/2 x^2 + N I/2 (x + y)^2 + (N^2 - N) I/2 y^2,

moments of inertia about the axis, of the parent and of the child, which turns at x + y, and a
smaller armature; likewise where the carrier is the child. That is exact, gyroscopic terms
included, and so said where both links stay possible bodies.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from ..inertia import pseudo
from ..inertia.consistency import is_consistent
from ..instants import at_no_time
from ..model import Model
from ..model_parameters import ROBOT
from ..robot import Body, Robot
from .motors import Motor

JOINT_TERMS = (
    "damping", "drag", "friction", "breakaway", "armature", "stiffness", "torque", "zero"
)  # fmt: skip
_PARALLEL = 1e-6  # rad between a rotor's axis and its joint's: of an axis typed with seven digits


@dataclass(frozen=True)
class Shaft:
    """A rotor that turns with several joints: its speed is row . qd, its inertia [kg m^2] resists
    that speed's change."""

    name: str
    row: np.ndarray
    inertia: float


@dataclass(frozen=True)
class Stated:
    """What a format says of a model.

    links: (links, 10) about the joints' frames, in the order of `robot.joints`.
    gravity: (3,) [m/s^2] in the base's axes.
    terms: {term: (dof,)} of JOINT_TERMS; stiffness and torque make k q + c.
    shafts: rotors of several joints.
    unsaid: (effect, joint) of the model that it leaves out; joint -1: of the robot.
    knows: the terms that the format knows.
    motors: {joint: its drive} where a command was logged in the place of torque.
    """

    robot: Robot
    links: np.ndarray
    gravity: np.ndarray
    terms: dict[str, np.ndarray]
    shafts: tuple[Shaft, ...]
    unsaid: tuple[tuple[str, int], ...]
    knows: frozenset[str]
    _model: pin.Model = field(repr=False)
    motors: dict[str, Motor] = field(default_factory=dict)

    def torque(self, q, qd, qdd) -> np.ndarray:
        """Inverse dynamics (n, dof) [N m or N] of what is said, by Pinocchio; at rest friction is
        zero.

        Args:
            q, qd, qdd: (n, dof).
        """
        drive, data = self.robot.transmission, self._model.createData()
        at = {name: own if name in self.knows else 0.0 for name, own in self.terms.items()}
        true = q + at["zero"]
        full = np.empty((len(q), len(drive)))
        for k, sample in enumerate(zip(true @ drive.T, qd @ drive.T, qdd @ drive.T)):
            full[k] = pin.rnea(self._model, data, *sample)
        out = full @ drive
        out += at["damping"] * qd + at["drag"] * np.abs(qd) * qd + at["friction"] * np.sign(qd)
        out += at["armature"] * qdd + at["stiffness"] * true + at["torque"]
        for shaft in self.shafts:
            out += shaft.inertia * (qdd @ shaft.row)[:, None] * shaft.row
        return out

    @property
    def inertias(self) -> list[tuple[float, np.ndarray, np.ndarray]]:
        """Mass [kg], centre of mass (3,) [m] and inertia about it (3, 3) [kg m^2] of each link,
        about its joint's frame."""
        return [(float(m), com, inertia) for m, com, inertia in map(pseudo.to_central, self.links)]

    @property
    def spring_angle(self) -> np.ndarray:
        """(dof,) measured angle at which each joint's spring is slack, zero where it has none."""
        k, c, zero = (self.terms[name] for name in ("stiffness", "torque", "zero"))
        return np.where(k > 0, -c / np.where(k > 0, k, 1.0) - zero, 0.0)


def stated(model: Model, x, knows: frozenset[str], shows: frozenset[str] = frozenset()) -> Stated:
    """What a format that knows some terms says of a model at its parameters x (size,).

    Args:
        knows: of JOINT_TERMS, and of `gravity`, `inertia` and `shaft` (rotors of several joints).
        shows: of JOINT_TERMS, those that stand in the file and do not act, or not in motion.
    """
    robot, count = model.robot, 10 * model.bodies
    pi, rest = np.asarray(x)[:count].reshape(-1, 10), np.asarray(x)[count:]
    dof = robot.dof
    terms, gravity = {name: np.zeros(dof) for name in JOINT_TERMS}, np.array(robot.gravity)
    links, unsaid, k = np.array(pi[:dof]), [], 0
    still = at_no_time(*np.zeros((3, 1, dof)))
    for term, (effect, joints) in enumerate(model.terms):
        words = [linear.name for linear in effect.coefficients()]
        for joint in joints:
            values = dict(zip(words, rest[k : k + len(words)].tolist()))
            values |= model.shapes_of(term, joint)
            k += len(words)
            means = effect.simulators if effect.instantaneous else {}
            if means and "torque" in means and values[means["stiffness"]] <= 0.0:
                means = {}  # a constant torque is no spring
            if not (means and set(means) <= knows):
                unsaid.append((effect.name, joint))
            if not (means and set(means) <= knows | shows):
                continue
            if joint != ROBOT:
                for name, word in means.items():
                    terms[name][joint] += values[word]
            elif "gravity" in means:
                gravity = np.asarray(effect.moved(still, ROBOT, **values).gravity)
            else:
                links[effect.body(robot)] += [values[word] for word in words]
    shafts: list[Shaft] = []
    for body, own in zip(robot.bodies[dof:], pi[dof:]):
        _ride(body, own, robot, links, terms["armature"], shafts, knows)
    machine = robot.with_inertias(np.concatenate([links, pi[dof:]]))
    for body in robot.bodies[dof:]:  # which ride on the links by now
        machine.inertias[body.row + 1] = pin.Inertia.Zero()
    machine.gravity.linear = gravity
    return Stated(robot, links, gravity, terms, tuple(shafts), tuple(unsaid), knows, machine)


def _ride(body: Body, pi, robot: Robot, links, armature, shafts: list[Shaft], knows) -> None:
    """Put a rotor on the links (links, 10) and into the armatures (dof,), in place."""
    turn, row = robot.rotations[body.row], robot.transmission[body.row]
    inertia, steady = _averaged(pi, robot.subspaces[body.row, 3:])
    carrier = _link_of(robot, robot.parents[body.row])
    if carrier is not None:
        links[carrier] += pseudo.displaced(steady, turn, robot.translations[body.row])
    driven = np.flatnonzero(row)
    if len(driven) > 1 and "shaft" in knows:
        shafts.append(Shaft(body.name, np.array(row), inertia))
    elif "armature" in knows:
        armature += inertia * row**2
        if len(driven) == 1 and carrier is not None:
            _couple(body, int(driven[0]), carrier, inertia, robot, links, armature)


def _couple(body: Body, joint: int, carrier: int, inertia: float, robot, links, armature) -> None:
    """Say a rotor's coupling with its carrier's turning by the links' own inertia, in place, where
    they stay possible."""
    at = robot.bodies[joint].row
    axis, parent = robot.subspaces[at, 3:], _link_of(robot, robot.parents[at])
    own = robot.rotations[body.row] @ robot.subspaces[body.row, 3:]
    in_parent = robot.rotations[at] @ axis
    seen = axis if carrier == joint else in_parent
    if carrier not in (parent, joint) or not axis.any():
        return
    if np.linalg.norm(np.cross(own, seen)) > _PARALLEL:
        return
    moved = inertia * robot.transmission[body.row, joint] * np.sign(own @ seen)
    tried = np.array(links)
    tried[joint] += _about(axis, moved)
    if parent is not None:
        tried[parent] -= _about(in_parent, moved)
    smaller = armature[joint] + (moved if carrier == joint else -moved)
    if smaller >= 0.0 and is_consistent(tried).all():
        links[:], armature[joint] = tried, smaller


def _averaged(pi, axis) -> tuple[float, np.ndarray]:
    """A rotor's moment of inertia about its axis, and its parameters (10,) averaged over a turn."""
    inertia, along = pseudo.rotational_inertia(pi), np.outer(axis, axis)
    about = float(axis @ inertia @ axis)
    steady = 0.5 * (np.trace(inertia) - about) * (np.eye(3) - along) + about * along
    return about, np.concatenate([pi[:1], along @ pi[1:4], _six(steady)])


def _about(axis, inertia: float) -> np.ndarray:
    """Parameters (10,) of a moment of inertia about an axis and nothing else."""
    return np.concatenate([np.zeros(4), _six(inertia * np.outer(axis, axis))])


def _six(inertia) -> np.ndarray:
    return inertia[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]


def _link_of(robot: Robot, row: int) -> int | None:
    """Number of the link that a row of the tree moves; None for the base."""
    return next((k for k, body in enumerate(robot.bodies[: robot.dof]) if body.row == row), None)
