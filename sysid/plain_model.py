"""What any robot has: rigid bodies with plain friction, rotors and an offset on every joint, and what an experiment says differs
between its logs."""

from __future__ import annotations

from .listed_effects import build, found
from .model import Model
from .robot import Robot
from .specs import EffectSpec, Experiment
from .warned import noticed

PLAIN = ("armature", "viscous", "coulomb", "torque_bias")  # what any joint has


def plain(experiment: Experiment, robot: Robot) -> Model:
    """The model of an experiment without the effects that only some robots have, whichever it has: what is chosen with it stays when
    one of these is added."""
    joints, args = robot.joints, (experiment.folder, experiment.data.logged)
    effects = [(one, found(one, *args)) for one in experiment.model.effects if one.per is not None]
    differ = [one for one, effect in effects if effect.coefficients() and not effect.shapes()]
    for name in PLAIN:
        own = [one.joints or joints for one in differ if one.name == name]
        if left := [joint for joint in joints if not any(joint in them for them in own)]:
            differ.append(EffectSpec(name=name, joints=left))
    with noticed():
        return build(robot, differ, *args, experiment.data.groups)
