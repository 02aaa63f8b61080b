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
    padded = np.empty((-(-n // size), size))
    padded.ravel()[:n], padded.ravel()[n:] = y, y[n - 1]  # its last again is no other sample
    nothing, start = np.isnan(padded), np.arange(len(padded)) * size
    some = bool(nothing.any())
    low, high = (np.where(nothing, end, padded) if some else padded for end in (np.inf, -np.inf))
    found = np.concatenate([[0], start + low.argmin(1), start + high.argmax(1), [n - 1]])
    return np.unique(np.minimum(found, n - 1))


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
