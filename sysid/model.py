"""Model = robot + effects: an ordered, named vector of parameters and the columns they multiply."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from . import regressor, units
from .effect import TorqueEffect, find
from .errors import ConfigError
from .inertia import PARAMETERS, UNITS
from .preprocess import Motion, Piece
from .robot import Robot

_CHUNK = 4096  # samples whose columns stand in memory at once


@dataclass(frozen=True)
class Coefficient:
    """One linear coefficient of an effect on a joint."""

    effect: str
    joint: int
    name: str
    unit: str
    positive: bool


@dataclass(frozen=True)
class Model:
    """A robot and the effects on its joints, in order. Immutable; estimates live in `Fit`.

    terms: (effect, joints that have it) in order.
    """

    robot: Robot
    terms: tuple[tuple[TorqueEffect, tuple[int, ...]], ...]

    @property
    def bodies(self) -> int:
        """Number of bodies; their parameters are the first 10 times as many."""
        return len(self.robot.bodies)

    @property
    def coefficients(self) -> tuple[Coefficient, ...]:
        """The effects' coefficients, after the bodies: by effect, then joint, then coefficient."""
        robot = self.robot
        return tuple(
            Coefficient(
                effect.name, joint, f"{effect.name}.{robot.joints[joint]}.{linear.name}",
                units.of_joint(linear.unit, prismatic=bool(robot.prismatic[joint])), linear.lower == 0,
            )  # fmt: skip
            for effect, joints in self.terms
            for joint in joints
            for linear in effect.coefficients()
        )

    @property
    def names(self) -> list[str]:
        """Names of all parameters: body.m … body.Ixz, then effect.joint.coefficient."""
        return [f"{body.name}.{p}" for body in self.robot.bodies for p in PARAMETERS] + [c.name for c in self.coefficients]

    @property
    def units(self) -> list[str]:
        """Units of all parameters."""
        return list(UNITS) * self.bodies + [c.unit for c in self.coefficients]

    def with_effect(self, effect: TorqueEffect, joints: tuple[int, ...]) -> "Model":
        """The model with one more effect."""
        return Model(self.robot, (*self.terms, (effect, joints)))

    def support(self, joint: int) -> np.ndarray:
        """Indices of the parameters that can enter the torque of a joint, ascending."""
        robot = self.robot
        depends = np.abs(robot.transmission) > 0
        for row, parent in enumerate(robot.parents):  # parents first: a body moves with what carries it
            if parent >= 0:
                depends[row] |= depends[parent]
        bodies = [10 * b + k for b, body in enumerate(robot.bodies) if depends[body.row, joint] for k in range(10)]
        first = 10 * self.bodies
        return np.array(bodies + [first + k for k, c in enumerate(self.coefficients) if c.joint == joint], dtype=int)

    def columns(self, piece: Piece, rows: slice) -> list[np.ndarray]:
        """For each joint the columns (support, n) of the rows `rows` of a piece, filtered where its torque is."""
        part = piece.part(_widened(piece, rows))
        inertial = regressor.columns(self.robot, part.q, part.qd, part.qdd)
        by_joint: list[list[np.ndarray]] = [[] for _ in self.robot.joints]
        for effect, joints in self.terms:
            for joint in joints:
                by_joint[joint].append(effect.columns(part, joint))
        out = []
        for joint, effects in enumerate(by_joint):
            bodies = self.support(joint)
            bodies = bodies[bodies < inertial.shape[1]]
            stacked = np.concatenate([inertial[joint, bodies], *effects]) if effects else inertial[joint, bodies]
            out.append(self._settled(piece, rows, stacked))
        return out

    def torque(self, piece: Piece, pi, c) -> np.ndarray:
        """Predicted torque (samples, dof) over a piece's core, of bodies pi (bodies, 10) and coefficients c."""
        out = np.empty((piece.samples, self.robot.dof))
        for rows in chunks(piece, _CHUNK if piece.smoother is None else 4 * _CHUNK):
            part = piece.part(_widened(piece, rows))
            predicted = regressor.torque(self.robot, pi, part.q, part.qd, part.qdd).T
            k = 0
            for effect, joints in self.terms:
                size = len(effect.coefficients())
                for joint in joints:
                    predicted[joint] += np.asarray(c)[k : k + size] @ effect.columns(part, joint)
                    k += size
            start = rows.start - piece.core.start
            out[start : start + rows.stop - rows.start] = self._settled(piece, rows, predicted).T
        return out

    @staticmethod
    def _settled(piece: Piece, rows: slice, values) -> np.ndarray:
        """Columns computed on widened rows, filtered as torque was and cut back to the rows."""
        if piece.smoother is None:
            return values
        wide = _widened(piece, rows)
        inner = slice(rows.start - wide.start, rows.stop - wide.start)
        return piece.smoother(values, axis=-1)[..., inner]


def _widened(piece: Piece, rows: slice) -> slice:
    """Rows with the margin that a filter needs for them to come out as over the whole piece."""
    if piece.smoother is None:
        return rows
    # a recursive filter forgets slowly: six times its one-per-cent reach leaves 1e-13
    margin = piece.smoother.reach * (6 if piece.smoother.kind == "butterworth" else 1)
    return slice(max(0, rows.start - margin), min(len(piece.t), rows.stop + margin))


def chunks(piece: Piece, size: int) -> Iterator[slice]:
    """The rows of a piece's core in runs of at most `size`."""
    for start in range(piece.core.start, piece.core.stop, size):
        yield slice(start, min(start + size, piece.core.stop))


def build(robot: Robot, effects) -> Model:
    """The model of an experiment's `model.effects`.

    Raises:
        ConfigError: an effect or joint that is not there, or an effect twice on a joint.
    """
    terms, seen = [], set()
    for spec in effects:
        names = spec.joints if spec.joints is not None else list(robot.joints)
        for name in names:
            if name not in robot.joints:
                raise ConfigError(f"model.effects: {spec.name} names the joint {name!r}", allowed=", ".join(robot.joints), do="correct the joint")
            if (spec.name, name) in seen:
                raise ConfigError(f"model.effects: {spec.name} stands twice on joint {name!r}", do="leave one out")
            seen.add((spec.name, name))
        terms.append((find(spec.name), tuple(robot.joints.index(name) for name in names)))
    return Model(robot, tuple(terms))


def moving_coefficients(model: Model, motion: Motion) -> np.ndarray:
    """(coefficients,) bool: False for those of a joint that never moves, which no data can tell."""
    return np.array([model.robot.joints[c.joint] not in motion.still for c in model.coefficients], dtype=bool)
