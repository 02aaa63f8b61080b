"""The motion without the noise of its angles: what functions of the motion may see of it.

Stamps that jitter, or a coarse encoder, make noise of the angles that stands in accelerations and
in what a model leaves alike. A flexible function of the one then tells the other, and nothing is
missing.
"""

from __future__ import annotations

import numpy as np

from ..frequencies import low

KEPT = 3.0  # bands of the motion: several, as its laws are bent functions of it


def calm(values: np.ndarray, piece, band: float, step: float) -> np.ndarray:
    """Variables (n, k) of a motion that stays below `band` [Hz], without what is faster, at rows
    `step` seconds apart of pieces (n,)."""
    if band <= 0.0:
        return values
    out = values.copy()
    for number in np.unique(piece):
        out[piece == number] = low(values[piece == number], KEPT * band, step)
    return out
