"""What could be missing: every effect of the vocabulary on every joint, with its variants."""

from __future__ import annotations

from dataclasses import dataclass

from ..effect import Effect, MotionEffect, SensorEffect, find, vocabulary
from ..model import ROBOT, Model

# What every model has to begin with is added first where it lacks; then what has a law; then what can bend to anything.
_PLAIN = ("viscous", "coulomb", "armature", "torque_bias")


@dataclass(frozen=True)
class Candidate:
    """An effect that is not in the model, on a joint (-1: the robot), with the options of a variant."""

    effect: Effect
    joint: int
    options: tuple[tuple[str, object], ...]

    @property
    def name(self) -> str:
        """The effect's word."""
        return self.effect.name

    @property
    def parameters(self) -> int:
        """How many numbers it brings."""
        return len(self.effect.coefficients()) + len(self.effect.shapes())

    @property
    def curved(self) -> bool:
        """Whether it has no columns of its own, only slopes."""
        return isinstance(self.effect, (MotionEffect, SensorEffect))

    def judged_by(self, dof: int) -> list[int]:
        """The joints whose error judges it: its own, or for the robot all."""
        return list(range(dof)) if self.joint == ROBOT else [self.joint]

    @property
    def simplicity(self) -> tuple:
        """Sorts the simplest first."""
        return (self.parameters, self.name not in _PLAIN, self.name)


def candidates(model: Model, extra=()) -> list[Candidate]:
    """Every effect that a model lacks, joint by joint; `extra` effects of the user's own come with the vocabulary."""
    robot = model.robot
    there = {(effect.name, joint) for effect, joints in model.terms for joint in joints}
    out = []
    for effect in [*(find(name) for name in vocabulary()), *extra]:
        for joint in [ROBOT] if effect.scope == "robot" else range(robot.dof):
            if (effect.name, joint) in there:
                continue
            for options in _variants(effect, robot, joint):
                out.append(Candidate(effect.given(**options).bound(robot, joint), joint, tuple(options.items())))
    return out


def _variants(effect: Effect, robot, joint: int) -> list[dict]:
    if effect.name == "joint_coupling" and robot.dof < 2:
        return []
    return effect.variants(robot, joint)
