"""Medians, means and maxima over a window that runs along a signal."""

from __future__ import annotations

import numpy as np


def running(values, size: int, what: str, edges: str = "symmetric") -> np.ndarray:
    """The `what` ("median", "mean" or "max") of `size` values about each of values (n, ...), as `scipy.ndimage` has it, whose import
    takes as long as a small fit: of an even size one more stands before a value than after it, and the upper median counts.

    Args:
        edges: what goes on beyond them, as of `numpy.pad`.
    """
    values = np.asarray(values, dtype=float)
    if not values.size:
        return values
    if values.ndim > 1:
        return np.stack([running(own, size, what, edges) for own in np.moveaxis(values, -1, 0)], axis=-1)
    import polars as pl

    before = size // 2
    series = pl.Series(np.pad(values, (before, size - 1 - before), mode=edges))
    if what == "median":
        out = series.rolling_quantile(0.5, interpolation="higher", window_size=size)
    else:
        out = getattr(series, f"rolling_{what}")(window_size=size)
    return out.to_numpy()[size - 1 :]
