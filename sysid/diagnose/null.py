"""One null for all candidates at once: what would the greatest statistic be if nothing were there?

What each block moves the coefficients by, m_b, keeps its size and gets a random sign (the wild
bootstrap of clusters, with the effect's own share left out); each draw is refitted, and the
greatest statistic over all groups is taken. A group whose statistic stands above all but a share of
these maxima is there at that family-wise level, whatever the number of candidates and however
alike.

Source: Westfall & Young 1993; Davidson & Flachaire 2008; Cameron, Gelbach & Miller 2008.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .. import blocks
from .evidence import Group, left_out


def statistics(groups: Sequence[Group]) -> np.ndarray:
    """(groups,) T of each, on the scale of a normal variable; NaN where it cannot be tested."""
    groups = [g.tested for g in groups]
    ratio = np.array([g.c @ g.c / max(np.sum(g.moves**2), 1e-300) for g in groups])
    directions, rest = np.array([g.freedom for g in groups]).T if groups else np.zeros((2, 0))
    found = normal_scores(ratio, directions, directions * np.maximum(rest - 1.0, 1.0))
    return np.where([g.testable for g in groups], found, np.nan)


def maxima(groups: Sequence[Group], rng: np.random.Generator, *, draws: int = 1000) -> np.ndarray:
    """(draws,) the greatest statistic over all groups where nothing is there; minus infinity where
    there are none."""
    out = np.full(draws, -np.inf)
    groups = [g.tested for g in groups if g.tested.testable]
    if not groups:
        return out
    sign = blocks.signs(len(groups[0].scores), draws, rng)
    by_size: dict[int, list[Group]] = {}
    for group in groups:
        by_size.setdefault(group.scores.shape[1], []).append(group)
    for own in by_size.values():
        out = np.maximum(out, _greatest(own, sign))
    return out


def _greatest(groups: list[Group], sign: np.ndarray) -> np.ndarray:
    squares = np.stack([g.squares for g in groups])  # (groups, blocks, k, k)
    moves = np.stack([g.moves for g in groups])
    directions, rest = np.array([g.freedom for g in groups]).T
    out = left_out(squares)
    # what a draw's own scores move by, before its refit
    again = np.einsum("gbkl,gbl->gbk", out, moves)
    pulled = out @ squares
    after = np.einsum("gbkl,gbl->gbk", pulled, again)
    twice = np.einsum("gbkl,gblm->gkm", pulled, pulled, optimize=True)
    norms = np.sum(again**2, axis=2)
    count, b, k = moves.shape
    flat = lambda a: np.moveaxis(a, 1, 0).reshape(b, count * k)  # noqa: E731
    c = (sign @ flat(moves)).reshape(-1, count, k)
    u = (sign @ flat(after)).reshape(-1, count, k)
    top = np.sum(c * c, axis=2)
    size = sign**2 @ norms.T
    bottom = (
        size
        - 2.0 * np.sum(c * u, axis=2)
        + np.einsum("dgk,gkl,dgl->dg", c, twice, c, optimize=True)
    )
    ratio = top / np.maximum(bottom, 1e-9 * size)
    return np.max(normal_scores(ratio, directions, directions * (rest - 1.0)), axis=1)


def normal_scores(statistic, directions, rest) -> np.ndarray:
    """F ratios with `directions` and `rest` degrees of freedom on the scale of a normal variable
    (Wilson & Hilferty 1931)."""
    one, two = 2.0 / (9.0 * directions), 2.0 / (9.0 * rest)
    root = np.cbrt(statistic)
    return ((1.0 - two) * root - (1.0 - one)) / np.sqrt(two * root**2 + one)
