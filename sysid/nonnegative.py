"""Least squares of two columns whose coefficients may not be negative."""

from __future__ import annotations

import numpy as np


def least_squares(columns, values) -> np.ndarray:
    """The coefficients (2,) >= 0 of columns (n, 2) that leave least of values (n,).

    Of two, the least within the bounds is the least without them, or one of them alone. As
    `scipy.optimize.nnls`, whose import takes a tenth of a second.
    """
    columns, values = np.asarray(columns, dtype=float), np.asarray(values, dtype=float)
    free = np.linalg.lstsq(columns, values, rcond=None)[0]
    if (free >= 0.0).all():
        return free
    pull, size = columns.T @ values, np.sum(columns**2, axis=0)
    alone = np.maximum(pull, 0.0) / np.where(size > 0.0, size, 1.0)
    best = int(np.argmax(alone * pull))  # what each takes by itself
    return np.where(np.arange(2) == best, alone, 0.0)
