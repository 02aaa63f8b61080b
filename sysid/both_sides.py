"""Both sides of the equation as the filter of the torque shows them, of many pieces at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .gaussian import Gaussian
from .motion import NO_WEIGHT, Piece


def settled(
    pieces: Sequence[Piece], values: Sequence, rows: Sequence[slice], joints: Sequence[int]
) -> np.ndarray:
    """`Piece.settled` of whole pieces, some of their rows, one piece after the other.

    Args:
        values: of each piece (..., joints, n), which stand for the torque of these joints.
    """
    pieces = tuple(pieces)
    filters = [piece.smoother for piece in pieces]
    first = filters[0]
    alike = isinstance(first, Gaussian) and all(
        isinstance(one, Gaussian) and (one.cutoff, one.step) == (first.cutoff, first.step)
        for one in filters
    )
    if len(pieces) == 1 or not alike or len({own.step for own in rows}) > 1:
        return np.concatenate(
            [
                np.stack([piece.settled(v[..., k, :], own, j) for k, j in enumerate(joints)], -2)
                for piece, v, own in zip(pieces, values, rows)
            ],
            axis=-1,
        )
    if all(piece.weight is None for piece in pieces):
        return first.each(values, rows)
    weights = [
        np.ones((len(joints), v.shape[-1])) if piece.weight is None else piece.weight[:, joints].T
        for piece, v in zip(pieces, values)
    ]
    counted = first.each([v * own for v, own in zip(values, weights)], rows)
    return counted / np.maximum(first.each(weights, rows), NO_WEIGHT)
