"""Fewer points of a long signal, for display: the least and the greatest of each bucket survive."""

from __future__ import annotations

import numpy as np


def kept(y, most: int = 2000) -> np.ndarray:
    """Indices, rising, of at most `most` samples that draw the same picture as all of them.

    The signal is cut into buckets of equal numbers of samples; each keeps its least and its
    greatest, and the signal its first and its last. NaN never stands for a bucket that has a
    number.

    Args:
        y: (n,). most: at least 4.
    """
    y = np.asarray(y, dtype=float)
    n = len(y)
    if n <= most:
        return np.arange(n)
    buckets = max((most - 2) // 2, 1)
    size = -(-n // buckets)
    padded = np.append(y, np.full(-n % size, np.nan)).reshape(-1, size)
    nothing = np.isnan(padded)
    start = np.arange(len(padded)) * size
    lows, highs = (
        start + np.argmin(np.where(nothing, np.inf, sign * padded), axis=1) for sign in (1.0, -1.0)
    )
    return np.unique(np.concatenate([[0], lows, highs, [n - 1]]))


def broken(t, y, breaks, most: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """The signal thinned, with a NaN wherever it is interrupted, so that no line is drawn across.

    Args:
        t, y: (n,). breaks: indices, rising, of samples that begin anew.
    """
    t, y = np.asarray(t, dtype=float), np.asarray(y, dtype=float)
    keep = kept(y, most)
    at = np.searchsorted(keep, np.asarray(breaks, dtype=int))
    at = np.unique(at[(at > 0) & (at < len(keep))])
    return np.insert(t[keep], at, np.nan), np.insert(y[keep], at, np.nan)
