"""Columns of joints that a robot does not move, in a log that also has those of its own."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

import numpy as np

_MOVES = 1e-2  # rad or m, or what stands for them in degrees or mm: less is a joint that was held


def beyond(
    names: Iterable[str], angle: str | None, torque: str | None, joints: Collection[str]
) -> dict[str, str]:
    """{name of a joint: column of its angle} of those that are none of `joints` and have both an
    angle and a torque.

    Args:
        names: of all columns. angle, torque: patterns with {joint}; what says nothing beside the
            joint's name fits any column.
    """
    every, found = set(names), {}
    if not (angle and torque) or "{joint}" in (angle, torque):
        return {}
    before, _, behind = angle.partition("{joint}")
    for name in sorted(every):
        inner = name[len(before) : len(name) - len(behind)]
        fits = name.startswith(before) and name.endswith(behind) and inner not in ("", *joints)
        if (
            fits
            and angle.replace("{joint}", inner) == name
            and torque.replace("{joint}", inner) in every
        ):
            found[inner] = name
    return found


def moving(columns: Mapping[str, str], values: Mapping[str, np.ndarray]) -> list[str]:
    """The joints whose angle goes anywhere."""
    return [joint for joint, column in columns.items() if np.ptp(values[column]) > _MOVES]


def says(joint: str, column: str, fixed: Collection[str]) -> tuple[str, str]:
    """What is said of such a joint, and what to do about it.

    Args:
        fixed: the joints of the robot's file that do not move.
    """
    if joint in fixed:
        return (
            f"{column} moves, and {joint} is a fixed joint in the robot's file: what it carries is "
            "taken to stand still, and its torque is not used",
            f"make {joint} revolute or prismatic there",
        )
    return (
        f"{column} moves, and the robot's file has no joint {joint}: what it carries is in no "
        "prediction",
        "give the robot's file with all joints that move; of a gripper's fingers it may do without",
    )
