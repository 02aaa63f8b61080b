"""Whether a torque is what moved the joint, or what was asked of its drive."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..fault import ERROR, WARNING, Fault
from ..look import Look

AFTER, SENSELESS = (
    3,
    ("wrong_unit", "angle_wrap", "joint_order", "sign_flipped", "torque_in_amperes"),
)
_BEYOND = 1.05  # times what the URDF allows
_FAR = 1.5  # times: further than rated limits are from what a drive can do
_FEWEST = 3  # rows
_LACKS = 0.2  # of the torque: more than masses and friction are wrong by


def find(look: Look) -> Iterator[Fault]:
    """commanded_torque where the motion does not show the torque beyond a limit, limit_exceeded
    where it does."""
    if look.seen is None:
        return
    rows = look.seen.rows
    for j, joint in enumerate(look.robot.joints):
        allowed, tau = look.robot.source.joints[joint].effort, rows.tau[:, j]
        within = rows.use[:, j] & (np.abs(tau) <= allowed)
        beyond = rows.use[:, j] & (np.abs(tau) > _BEYOND * allowed)
        if beyond.sum() < _FEWEST or within.sum() < _FEWEST:
            continue
        columns = look.seen.columns(j)
        told = columns @ np.linalg.lstsq(columns[within], tau[within], rcond=1e-4)[0]
        lacks = float(np.median(1.0 - told[beyond] / tau[beyond]))
        at = int(np.argmax(np.abs(tau) * beyond))
        name = look.part("train")[int(rows.log[at])].log.name
        most, rest = (
            f"the torque of {joint} reaches {tau[at]:.4g} in {name}",
            f"{allowed:.4g} that the URDF allows its drive",
        )
        told_at, count = (float(rows.t[at]),), int(beyond.sum())
        if lacks > _LACKS:
            yield Fault(
                "commanded_torque",
                ERROR,
                (
                    f"{most}, more than the {rest}, and the motion lacks {100 * lacks:.0f} "
                    "% of it: a command, or another unit"
                ),
                (
                    "log what the drive measured; a command beyond its limit is not what "
                    "moved the joint"
                ),
                joint,
                name,
                told_at,
                count,
            )
        elif abs(tau[at]) > _FAR * allowed:
            yield Fault(
                "limit_exceeded",
                WARNING,
                f"{most}, more than the {rest}, and the motion shows it",
                "is this the joint's column, its unit, this robot's URDF?",
                joint,
                name,
                told_at,
                count,
            )
