"""Whether what stands for a torque is an angle or a speed of the same log."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...units import ANGLES, POSITION, scales
from ..equations import FEWEST, Reading
from ..fault import ERROR, WARNING, Fault
from ..look import Look

AFTER, SENSELESS = 0.5, ("joint_order",)
# of its squares, that are left of it: one unit of torque for each unit of speed within three
# hundredths; and of its squares, what the URDF's bodies need: with so much friction is not alone
_LEFT, _BODIES = 1e-3, 0.05
_WORDS = {"q": ("an angle", "a position"), "qd": ("a speed", "a speed")}


def find(look: Look) -> Iterator[Fault]:
    """joint_order, of torques that are angles or speeds, in whatever unit these may be logged."""
    if look.seen is None or look.experiment.data.units.torque == "A":
        return
    rows, joints = look.seen.rows, look.robot.joints
    motion = {name: rows.of(look.seen.motion, name) for name in _WORDS}
    scored = look.equations.scored(Reading.plain(look.robot.dof))
    for j, joint in enumerate(joints):
        use = rows.use[:, j]
        tau = rows.tau[use, j]
        if use.sum() < FEWEST or not np.ptp(tau) > 0.0 or joint in look.experiment.data.torque:
            continue
        if (found := _source(tau, {n: v[use] for n, v in motion.items()}, look, j)) is None:
            continue
        name, k = found
        whose = "its own" if k == j else f"that of {joints[k]}"
        word = _WORDS[name][bool(look.robot.prismatic[k])]
        moved = scored.bodies[j] > _BODIES * scored.whole[j]
        yield Fault(
            "joint_order",
            ERROR if moved or k != j else WARNING,
            f"what stands for the torque of {joint} is {word}, {whose}"
            + ("" if moved or k != j else ", or it has friction of as much and nothing else"),
            "name the column of its torque in data.columns.torque, or in data.torque",
            joint,
        )


def _source(tau: np.ndarray, motion: dict[str, np.ndarray], look: Look, j: int):
    """The signal and the joint's number of which a torque (n,) is, its own first; None of none."""
    scale = scales(look.experiment.data.units.torque, look.robot.prismatic)[j]
    for name, values in motion.items():
        for k in (j, *(k for k in range(look.robot.dof) if k != j)):
            sizes = ("m", "mm") if look.robot.prismatic[k] else ANGLES
            if any(_is(tau / scale, values[:, k] / POSITION[unit]) for unit in sizes):
                return name, k
    return None


def _is(tau: np.ndarray, values: np.ndarray) -> bool:
    """Whether some values (n,), but for a constant, are others."""
    mean = tau.mean() - values.mean()
    whole = np.sum((tau - tau.mean()) ** 2)
    return bool(np.sum((tau - values - mean) ** 2) < _LEFT * whole)
