"""What drives the joints of an experiment without torque, as a simulator's actuators: servos and
DC motors with their gains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..drives import DRIVE_EFFECTS, LateCommand, factors
from ..model import Model
from ..motor_side import drive
from ..specs import Experiment


@dataclass(frozen=True)
class Motor:
    """A drive of a joint: torque = gain (command - q) - damping qd of a servo, gain voltage -
    damping qd of a DC motor, the command `delay` seconds before. gain [N m/rad or N m/V], damping
    [N m s/rad]: zero where it was found as the joint's own.
    """

    joint: str
    servo: bool
    gain: float
    damping: float
    delay: float


def motors(experiment: Experiment, model: Model, x) -> dict[str, Motor]:
    """{joint: its drive} of the joints whose command was logged in the place of torque.

    Args:
        x: (size,) parameters of the model.
    """
    late = {
        c.joint: value
        for c, value in zip(model.coefficients, np.asarray(x)[10 * model.bodies :])
        if c.effect == LateCommand.name
    }
    gains, out = factors(experiment, model), {}
    for joint, spec in experiment.actuator.items():
        own = drive(spec)
        more = late.get(model.robot.joints.index(joint), 0.0) / gains[joint]
        out[joint] = Motor(
            joint, own.servo, gains[joint], own.damping or 0.0, float(own.delay + more)
        )
    return out


def joint_side(model: Model, x) -> tuple[Model, np.ndarray]:
    """A model and its parameters without what belongs to the drives: what the joints need,
    whatever turns them."""
    kept = np.ones(model.size, dtype=bool)
    for effect, joints in model.terms:
        if isinstance(effect, DRIVE_EFFECTS):
            mine = [c.effect == effect.name and c.joint in joints for c in model.coefficients]
            kept[10 * model.bodies :] &= ~np.array(mine, dtype=bool)
    for effect, joints in model.terms:
        for joint in joints if isinstance(effect, DRIVE_EFFECTS) else ():
            model = model.without(effect.name, joint)
    return model, np.asarray(x)[kept]


def told(found: dict[str, Motor]) -> list[str]:
    """What a file's comment says of drives."""
    kinds = {True: "Servo", False: "DC motor"}
    late = [motor for motor in found.values() if motor.delay]
    return [f"{kinds[m.servo]} of {m.joint}: its command acts {m.delay:.4g} s late." for m in late]
