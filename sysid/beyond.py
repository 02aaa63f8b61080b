"""Columns of joints that a robot does not move, in a log that also has those of its own."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

import numpy as np

_MOVES = {"rad": 1e-2, "deg": 0.6, "turns": 1.6e-3, "mm": 10.0}  # less is a joint that was held


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


def moving(
    columns: Mapping[str, str], values: Mapping[str, np.ndarray], unit: str = "rad"
) -> list[str]:
    """The joints whose angle goes anywhere. unit: of angles."""
    least = _MOVES.get(unit, _MOVES["rad"])
    own = {joint: np.asarray(values[column], dtype=float) for joint, column in columns.items()}
    known = {joint: values[np.isfinite(values)] for joint, values in own.items()}
    return [joint for joint, values in known.items() if len(values) and np.ptp(values) > least]


def carries(every: Mapping, joint: str, moved: Collection[str]) -> bool:
    """Whether one of the joints that move hangs behind a joint.

    Args:
        every: {name: joint} of the robot's file, each with its `parent` and `child` link.
    """
    behind = [every[joint].child] if joint in every else []
    for link in behind:  # which grows as it is gone through
        after = [(name, own.child) for name, own in every.items() if own.parent == link]
        if any(name in moved for name, _ in after):
            return True
        behind += [child for _, child in after]
    return False


def says(joint: str, column: str, fixed: Collection[str]) -> tuple[str, str]:
    """What is said of such a joint, and what to do about it.

    Args:
        fixed: the joints of the robot's file that do not move.
    """
    if joint in fixed:
        return (
            f"{column} moves, and {joint} is a fixed joint in the robot's file: what it carries is "
            "taken to stand still, and its torque is not used",
            f"make {joint} revolute or prismatic there; a gripper's finger may stay as it is",
        )
    return (
        f"{column} moves, and the robot's file has no joint {joint}: what it carries is in no "
        "prediction",
        "give the robot's file with all joints that move; of a gripper's fingers it may do without",
    )
