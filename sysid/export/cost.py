"""What a description leaves out -> the torque that this costs on the test logs, joint by joint."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .. import regressor
from ..model import Model
from ..model_parameters import place
from ..motion import Motion
from .stated import Stated, stated


@dataclass(frozen=True)
class Cost:
    """Something that a format cannot say: `what` (an effect, or `rotors`: their imbalance and what
    is left of their coupling with the links' turning), the joint that has it (`*`: the robot), and
    the RMS {joint: N m or N} of the torque that goes with it, None where there is no test log."""

    what: str
    joint: str
    torque: dict[str, float] | None


def costs(
    model: Model, x, said: Stated, motion: Motion | None
) -> tuple[tuple[Cost, ...], dict[str, float] | None]:
    """What a description leaves out of a model, and the RMS of all that together, None where there
    is no test log.

    Args:
        x: (size,) parameters of the model.
        motion: of the test logs, or None.
    """
    joints, rotors = model.robot.joints, len(model.robot.bodies) > model.robot.dof
    named = [(name, place(joint, joints)) for name, joint in said.unsaid]
    if motion is None:
        left = [*named, *([("rotors", "*")] if rotors else [])]
        return tuple(Cost(*entry, None) for entry in left), None
    # torque as the robot has it, not as a filter shows it
    plain = replace(motion, pieces=tuple(replace(p, smoother=None) for p in motion.pieces))
    rms = lambda values: dict(zip(joints, _rms(values, plain).tolist()))  # noqa: E731
    whole = _predicted(model, x, plain)
    found = [
        Cost(*entry, rms(whole - _predicted(*_without(model, x, *key), plain)))
        for entry, key in zip(named, said.unsaid)
    ]
    samples = sampled(plain)
    if rotors:
        found.append(Cost("rotors", "*", rms(_of_rotors(model, x, said, samples))))
    return tuple(found), rms(whole - said.torque(*samples))


def sampled(motion: Motion) -> list[np.ndarray]:
    """q, qd, qdd (n, dof) of a motion."""
    names = ("q", "qd", "qdd")
    return [np.concatenate([getattr(p, name)[p.core] for p in motion.pieces]) for name in names]


def _predicted(model: Model, x, motion: Motion) -> np.ndarray:
    pi, c = np.split(np.asarray(x), [10 * model.bodies])
    return np.concatenate([model.torque(p, pi.reshape(-1, 10), c) for p in motion.pieces])


def _rms(values, motion: Motion) -> np.ndarray:
    use = np.ones(values.shape, dtype=bool)
    if motion.pieces[0].use is not None:
        use = np.concatenate([piece.use[piece.core] for piece in motion.pieces])
    return np.sqrt((values**2 * use).sum(0) / np.maximum(use.sum(0), 1))


def _without(model: Model, x, name: str, joint: int) -> tuple[Model, np.ndarray]:
    """The model without an effect on a joint, and its parameters."""
    first = 10 * model.bodies
    own = [c.effect == name and c.joint == joint for c in model.coefficients]
    return model.without(name, joint), np.delete(np.asarray(x), first + np.flatnonzero(own))


def _of_rotors(model: Model, x, said: Stated, samples) -> np.ndarray:
    """Torque (n, dof) of the bodies less what is said of them."""
    pi = np.asarray(x)[: 10 * model.bodies]
    alone = stated(replace(model, terms=(), shapes=(), held=()), pi, said.knows)
    return regressor.torque(model.robot, pi.reshape(-1, 10), *samples) - alone.torque(*samples)
