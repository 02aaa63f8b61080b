"""Ridge regression, judged on stretches of time that it was not fitted on."""

from __future__ import annotations

import numpy as np
from scipy.linalg import get_lapack_funcs

from .. import eigen
from .functions import that_say_something

_APART = (
    0.15  # s, several memories of the filters: what is predicted, and what it is predicted from
)
_RIDGES = np.geomspace(1e-3, 30.0, 10)
_FIRST = (4, 8)  # of these: what functions say where there is a law, and where there is none
_MANY = 64  # columns from which on a factor for each ridge costs less than the eigenvalues for all


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
    kept, _, size = that_say_something(features, use)
    if not len(size):
        return np.zeros(len(y)), np.zeros(len(spans))
    ridges = _RIDGES * len(y) / len(_RIDGES)
    whole, right = kept.T @ kept, kept.T @ y
    sizes = np.outer(size, size)  # in functions of unit size a ridge is the same for all
    folds = [
        (
            (whole - (here := kept[near]).T @ here) / sizes,
            (right - here.T @ y[near]) / size,
            kept[rows],
        )
        for rows, near in spans
    ]
    gains, all_told = np.full((len(ridges), len(spans)), -np.inf), np.zeros((len(ridges), len(y)))

    def tell(some: list[int]):
        for f, ((rows, _), (system, pull, own)) in enumerate(zip(spans, folds)):
            told = (own @ (_solved(system, ridges[some], pull) / size[:, None])).T
            all_told[np.ix_(some, rows)] = told
            gains[some, f] = np.sum(2.0 * told * y[rows] - told**2, axis=1)

    # more ridge serves better up to some, and worse from there: up the hill from both
    more, known = list(_FIRST) if len(whole) >= _MANY else list(range(len(ridges))), set()
    while more:
        tell(more)
        known |= set(more)
        # the ridge of a fold is the one that serves the other folds best
        others = gains.sum(1)[:, None] - np.where(np.isfinite(gains), gains, 0.0)
        chosen = np.argmax(others, axis=0)
        beside = {int(at) + step for at in chosen for step in (-1, 1)}
        more = sorted(beside & set(range(len(ridges))) - known)
    told = np.zeros(len(y))
    for i, (rows, _) in zip(chosen, spans):
        told[rows] = all_told[i, rows]
    return told, gains[chosen, np.arange(len(spans))]


def _solved(system, ridges, right) -> np.ndarray:
    """Coefficients (k, ridges) of normal equations with each of some ridges; in single precision
    where its rounding (Higham 2002, theorem 10.3) is below the least of them."""
    if len(system) < _MANY:
        values, vectors = eigen.symmetric(system)
        shrunk = (vectors.T @ right)[:, None] / (np.clip(values, 0.0, None)[:, None] + ridges)
        return vectors @ shrunk
    rounding = len(system) * np.finfo(np.float32).eps * np.diagonal(system).max()
    kind = np.float32 if rounding < min(ridges) else np.float64
    system, right = system.astype(kind), right.astype(kind)
    (posv,), out = get_lapack_funcs(("posv",), (system,)), []
    for ridge in ridges:
        definite = system.copy()
        definite.flat[:: len(system) + 1] += kind(ridge)
        out.append(posv(definite.T, right, overwrite_a=True)[1])  # as LAPACK wants its columns
    return np.stack(out, axis=1).astype(float)
