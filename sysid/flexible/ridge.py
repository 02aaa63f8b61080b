"""Ridge regression, judged on stretches of time that it was not fitted on."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dposv

from .functions import of_unit_size

_APART = (
    0.15  # s, several memories of the filters: what is predicted, and what it is predicted from
)
_RIDGES = np.geomspace(1e-3, 30.0, 10)
_MANY = 64  # columns from which on a factor for each ridge costs less than the eigenvalues for all
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
    gain (folds,)."""
    scaled, _ = of_unit_size(features, use)
    if not scaled.shape[1]:
        return np.zeros(len(y)), np.zeros(len(spans))
    ridges = _RIDGES * len(y) / len(_RIDGES)
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    large = values > _LEAST * ridges[0]
    scaled = scaled @ vectors[:, large]
    system, right = np.diag(values[large]), scaled.T @ y
    gains, all_told = np.zeros((len(ridges), len(spans))), np.zeros((len(ridges), len(y)))
    for f, (rows, near) in enumerate(spans):
        here = scaled[near]
        own, pull = system - here.T @ here, right - here.T @ y[near]
        told = (scaled[rows] @ _solved(own, ridges, pull)).T
        all_told[:, rows] = told
        gains[:, f] = np.sum(2.0 * told * y[rows] - told**2, axis=1)
    # the ridge of a fold is the one that serves the other folds best
    chosen = [int(np.argmax(gains.sum(1) - gains[:, f])) for f in range(len(spans))]
    told = np.zeros(len(y))
    for i, (rows, _) in zip(chosen, spans):
        told[rows] = all_told[i, rows]
    return told, np.array([gains[i, f] for f, i in enumerate(chosen)])


def _solved(system, ridges, right) -> np.ndarray:
    """Coefficients (k, ridges) of normal equations with each of some ridges."""
    if len(system) < _MANY:
        values, vectors = np.linalg.eigh(system)
        shrunk = (vectors.T @ right)[:, None] / (np.clip(values, 0.0, None)[:, None] + ridges)
        return vectors @ shrunk
    out = []
    for ridge in ridges:
        definite = system.copy()
        definite.flat[:: len(system) + 1] += ridge
        out.append(dposv(definite.T, right, overwrite_a=True)[1])  # as LAPACK wants its columns
    return np.stack(out, axis=1)
