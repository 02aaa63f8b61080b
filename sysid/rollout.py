"""A fitted model with its drives, let go: what the joints would do under the logged commands.

The loop of servo, motor, friction and bodies is integrated in time from where a held-out log begins; the log's angles are
looked at for nothing else. Friction truly sticks, as in a simulation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import motor_side
from .drives import DriveDamping, FreeGain, LateCommand, factors
from .model import Model
from .motion import Motion, Piece
from .specs import Experiment

if TYPE_CHECKING:
    from .simulate.plant import Plant

_PERIOD = 1e-3  # s, at most, in which the commanded torque is constant
_KNOWN = ("viscous", "coulomb", "armature")  # what the plant has beside the drive


def can_roll(experiment: Experiment, model: Model) -> bool:
    """Whether the drive of every joint is known, and every effect is one that the plant has, in all logs."""
    if model.groups:
        return False  # the plant is one robot
    driven = set(model.robot.joints) == set(experiment.actuator)
    return driven and all(effect.name in _KNOWN or isinstance(effect, (FreeGain, DriveDamping, LateCommand)) for effect, _ in model.terms)


def rolled(experiment: Experiment, model: Model, x, motion: Motion) -> list[np.ndarray]:
    """Angles (n, dof) that the closed loop comes to under each piece's commands, from where the piece begins.

    Args:
        x: (size,) linear parameters.
    """
    from .simulate.plant import Plant, Truth  # few experiments need a simulator

    robot = model.robot
    value = lambda name, joint: _of(model, x, f"{name}.{joint}")  # noqa: E731
    viscous = np.array([value("viscous", j) + value(DriveDamping.name, j) for j in robot.joints])
    truth = Truth(
        np.asarray(x)[: 10 * model.bodies].reshape(-1, 10), np.array(robot.gravity), viscous,
        np.array([value("coulomb", j) for j in robot.joints]), np.array([value("armature", j) for j in robot.joints]),
    )  # fmt: skip
    known = factors(experiment, model)
    factor = np.array([known[j] for j in robot.joints])
    drives = [motor_side.drive(experiment.actuator[j]) for j in robot.joints]
    late = np.array([own.delay + value(LateCommand.name, j) / known[j] for own, j in zip(drives, robot.joints)])
    servo = np.array([own.servo for own in drives])
    commands = lambda piece: [piece.signals[motor_side.command_name(j)] for j in robot.joints]  # noqa: E731
    return [_run(Plant(robot, truth, [], p.q[0]), p, commands(p), factor, late, servo) for p in motion.pieces]


def _of(model: Model, x, name: str) -> float:
    """The coefficient of an effect on a joint, zero where the model has none."""
    return next((float(v) for n, v in zip(model.names, x) if n.rpartition(".")[0] == name), 0.0)


def _run(plant: Plant, piece: Piece, commands, factor, late, servo) -> np.ndarray:
    fine = max(1, int(np.ceil(piece.step / _PERIOD - 1e-9)))
    h = piece.step / fine
    middle = piece.t[0] + h * (np.arange(fine * (len(piece.t) - 1)) + 0.5)
    acts = np.stack([np.interp(middle - late[j], piece.t, command) for j, command in enumerate(commands)], axis=1)
    made, stiffness = factor * acts, np.where(servo, factor, 0.0)
    out = np.empty(piece.q.shape)
    plant.v = np.array(piece.qd[0])
    plant.a = np.array(piece.qdd[0])
    plant.sign = np.sign(plant.v).astype(int).tolist()
    for k in range(len(piece.t)):
        out[k] = plant.x
        if k + 1 == len(piece.t):
            break
        for i in range(k * fine, (k + 1) * fine):
            plant.freeze(middle[i], 0.5 * h)
            plant.advance(made[i] - stiffness * plant.xm, h)
    return out


def rms(experiment: Experiment, model: Model, x, motion: Motion) -> dict[str, float] | None:
    """{joint: RMS [rad or m] by which the closed loop misses the held-out angles}; None where the drives or effects are not such
    as can be let go, or the loop runs away."""
    if not can_roll(experiment, model):
        return None
    with np.errstate(all="ignore"):
        miss = np.concatenate([own - piece.q for own, piece in zip(rolled(experiment, model, x, motion), motion.pieces)])
        found = np.sqrt(np.mean(miss**2, axis=0))
    return dict(zip(model.robot.joints, found.tolist())) if np.isfinite(found).all() else None
