"""A model's columns over a motion, a stretch of its rows at a time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .kept_columns import kept_columns
from .model import Model, chunks
from .motion import Motion

_STRETCH = 16384  # samples whose columns are computed at once
_PASSING = 4096  # and where nobody asks for them again


def stretches(model: Model, motion: Motion, stride: int, *, keep: bool = True) -> Iterator[tuple[slice, list[tuple[np.ndarray, np.ndarray]]]]:
    """Which of the rows that a stride keeps, of all pieces, these are; of each joint, the parameters that can enter its torque there
    and their columns (support, n).

    Args:
        keep: what does not change for whoever asks again.
    """
    at = 0
    for piece in motion.pieces:
        remembered, supports = model.remembered(piece), [model.support(joint, piece) for joint in range(model.robot.dof)]
        # a stretch holds a whole number of strides, so that the kept rows go on where the last stretch ended
        for rows in chunks(piece, stride * max(1, (_STRETCH if keep else _PASSING) // stride)):
            parts = (kept_columns if keep else Model.columns)(model, piece, slice(rows.start, rows.stop, stride), remembered)
            size = parts[0].shape[-1]
            yield slice(at, at + size), list(zip(supports, parts))
            at += size
