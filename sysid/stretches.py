"""A model's columns over a motion, a stretch of its rows at a time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .model import Model, chunks
from .motion import Motion, Piece

_STRETCH = 16384  # samples whose columns are computed at once
_PASSING = 4096  # and where nobody asks for them again


def stretches(model: Model, motion: Motion, stride: int, *, keep: bool = True) -> Iterator[tuple[Piece, slice, list[np.ndarray]]]:
    """Piece by piece: the piece, which of the rows that a stride keeps, of all pieces, these are, and each joint's columns (support, n).

    Args:
        keep: as of `Model.columns`.
    """
    at = 0
    for piece in motion.pieces:
        remembered = model.remembered(piece)
        # a stretch holds a whole number of strides, so that the kept rows go on where the last stretch ended
        for rows in chunks(piece, stride * max(1, (_STRETCH if keep else _PASSING) // stride)):
            parts = model.columns(piece, slice(rows.start, rows.stop, stride), remembered, keep=keep)
            size = parts[0].shape[-1]
            yield piece, slice(at, at + size), parts
            at += size
