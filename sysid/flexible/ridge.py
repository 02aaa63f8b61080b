"""Ridge regression, judged on stretches of time that it was not fitted on."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dposv

from .functions import of_unit_size

_APART = (
    0.15  # s, several memories of the filters: what is predicted, and what it is predicted from
)
_RIDGES = np.geomspace(1e-3, 30.0, 10)
_PATIENCE = 2  # ridges that may tell less than a greater one before no smaller one is tried
_LEAST = 0.1  # of the least ridge: a direction with less is a tenth at most of what it would be


def stretches(fold, t, piece) -> list[tuple[np.ndarray, np.ndarray]]:
    """For each fold its rows, and these with all that stand within a while of them: what noise
    remembers must not tell what is left out (Racine 2000)."""
    apart = min(_APART, np.ptp(t) / 40.0)
    out = []
    for f in range(fold.max() + 1):
        own = np.flatnonzero(fold == f)
        near = np.zeros(len(fold), dtype=bool)
        for stretch in np.split(own, np.flatnonzero(np.diff(own) > 1) + 1):
            here = piece == piece[stretch[0]]
            near |= here & (t >= t[stretch[0]] - apart) & (t <= t[stretch[-1]] + apart)
        out.append((own, np.flatnonzero(near)))
    return out


def predicted(features, y, use, spans) -> tuple[np.ndarray, np.ndarray]:
    """What ridge regression predicts (n,) of the rows of each fold from rows apart from it, and its
    gain (folds,).

    Ridges are tried from the greatest on, as long as one of the last few told more than all before.
    """
    scaled, _ = of_unit_size(features, use)
    if not scaled.shape[1]:
        return np.zeros(len(y)), np.zeros(len(spans))
    ridges = _RIDGES[::-1] * len(y) / len(_RIDGES)
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    scaled = scaled @ vectors[:, values > _LEAST * ridges[-1]]
    system, right = scaled.T @ scaled, scaled.T @ y
    parts = [_without(system, right, scaled[near], y[near]) for _, near in spans]
    gains, all_told = [], []
    for ridge in ridges:
        told = np.zeros(len(y))
        for (rows, _), (own, pull) in zip(spans, parts):
            told[rows] = scaled[rows] @ _solved(own, ridge, pull)
        gain = 2.0 * told * y - told**2
        gains.append([gain[rows].sum() for rows, _ in spans])
        all_told.append(told)
        best = int(np.argmax(np.sum(gains, axis=1)))
        if len(gains) - best > _PATIENCE:
            break
    # the ridge of a fold is the one that serves the other folds best
    table = np.array(gains)
    chosen = np.argmax(table.sum(axis=1, keepdims=True) - table, axis=0)
    told = np.zeros(len(y))
    for i, (rows, _) in zip(chosen, spans):
        told[rows] = all_told[i][rows]
    return told, table[chosen, np.arange(len(spans))]


def _without(system, right, near, values):
    """Normal equations without some rows."""
    return system - near.T @ near, right - near.T @ values


def _solved(system, ridge: float, right) -> np.ndarray:
    """Coefficients of normal equations with a ridge, which makes them definite."""
    definite = system.copy()
    definite.flat[:: len(system) + 1] += ridge
    return dposv(definite.T, right, overwrite_a=True)[1]  # columns first, as LAPACK wants them
