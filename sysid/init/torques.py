"""The units of torques and forces that the names of columns state."""

from __future__ import annotations

import numpy as np

from ..units import TORQUE, in_header, scales
from .guess import Guess


def named(columns: dict[str, str], slides: dict[str, bool]) -> list[Guess]:
    """The unit that columns of torque (force) state in brackets: of all, or of some joints a factor
    each."""
    said = {joint: in_header(column, "torque") for joint, column in columns.items()}
    said = {joint: unit for joint, unit in said.items() if TORQUE.get(unit, 1.0) != 1.0}
    if not said:
        return []
    why, one = "the columns' names say so", said[min(said)]
    scale = scales(one, [slides[joint] for joint in columns])
    if set(said.values()) == {one} and len(said) == np.sum(scale != 1.0):
        return [Guess("data.units.torque", one, why)]
    factors = {joint: {columns[joint]: TORQUE[unit]} for joint, unit in said.items()}
    # others' headers stand beside a unit that is written
    return [Guess("data.units.torque", "N m", why), Guess("data.torque", factors, why)]
