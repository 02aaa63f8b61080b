"""Angles of a log that jump by a turn."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..full_turns import ADVICE, TURN, jumps
from ..units import POSITION
from .logged import Logged


def told(
    data: list[Logged], used: list[str], slides: dict[str, bool], unit: str
) -> tuple[str, ...]:
    """What to say of each joint and log in which the angle jumps by a turn."""
    notes = []
    for one in data:
        logged = {j: one.q[j] for j in used if j in one.q}
        for joint, count in wraps(logged, slides, unit).items():
            notes.append(
                f"the angle of {joint} jumps by a turn {count} times in {Path(one.name).name}: "
                f"{ADVICE}"
            )
    return tuple(notes)


def wraps(q: dict[str, np.ndarray], slides: dict[str, bool], unit: str) -> dict[str, int]:
    """How often each turning joint's angle jumps by a turn, of those that do."""
    found = {j: jumps(POSITION[unit] * np.diff(v)) for j, v in q.items() if not slides[j]}
    return {joint: int(jumped.sum()) for joint, jumped in found.items() if jumped.any()}


def within_a_turn(data: list[Logged], used: list[str], slides: dict[str, bool]) -> bool:
    """Whether the angles of all joints that jump by 2 pi stay within a turn of zero, as what was
    wrapped does, and go by little from sample to sample otherwise."""
    logged = [{joint: one.q[joint] for joint in used if joint in one.q} for one in data]
    jumping = {joint for q in logged for joint in wraps(q, slides, "rad")}
    each = [q[joint] for q in logged for joint in jumping if joint in q]
    return bool(each) and all(
        np.abs(q).max() < 1.1 * TURN and np.quantile(np.abs(np.diff(q)), 0.9) < 0.1 * TURN
        for q in each
    )
