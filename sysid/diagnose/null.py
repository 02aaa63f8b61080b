"""One null for all candidates at once: what would the greatest statistic be if nothing were there?

What each block moves the coefficients by, m_b, keeps its size and is multiplied by a normal
variable, the same for all groups on a joint (the multiplier bootstrap of clusters, with the
effect's own share left out), and the greatest statistic over all groups is taken. A group whose
statistic stands above all but a share of these maxima is there at that family-wise level, whatever
the number of candidates and however alike. Random signs reach no further than the blocks do.

Source: Westfall & Young 1993; Chernozhukov, Chetverikov & Kato 2013 (maxima by normal
multipliers); Cameron, Gelbach & Miller 2008 (clusters).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .. import blocks
from .evidence import Group


def believed(groups: Sequence[Group]) -> blocks.Belief:
    """How far the spread that noise of one spectrum foresees is right, over all groups."""
    groups = [g.tested for g in groups if g.tested.testable]
    most = max((len(g.scores) for g in groups), default=1)
    return blocks.believed(*_spreads(groups), most)


def _spreads(groups: Sequence[Group]) -> np.ndarray:
    """(3, groups)."""
    return np.array([g.spreads for g in groups]).reshape(-1, 3).T


def statistics(groups: Sequence[Group], belief: blocks.Belief = blocks.UNTOLD) -> np.ndarray:
    """(groups,) T of each, on the scale of a normal variable; NaN where it cannot be tested."""
    groups = [g.tested for g in groups]
    spread, rest = belief.moderated(*_spreads(groups))
    ratio = np.array([g.c @ g.c for g in groups]) / np.maximum(spread, 1e-300)
    found = blocks.normal_scores(ratio, np.array([g.freedom[0] for g in groups]), rest)
    return np.where([g.testable for g in groups], found, np.nan)


def maxima(
    groups: Sequence[Group],
    rng: np.random.Generator,
    belief: blocks.Belief = blocks.UNTOLD,
    *,
    draws: int = 1000,
) -> np.ndarray:
    """(draws,) the greatest statistic over all groups where nothing is there; minus infinity where
    there are none."""
    out = np.full(draws, -np.inf)
    groups = [g.tested for g in groups if g.tested.testable]
    if not groups:
        return out
    noise = rng.normal(size=(2, draws, len(groups[0].scores)))
    by_size: dict[int, list[Group]] = {}
    for group in groups:
        by_size.setdefault(group.scores.shape[1], []).append(group)
    for own in by_size.values():
        top, spread = blocks.redrawn(np.stack([g.moves for g in own]), noise)
        seen = _spreads(own)
        loud = belief.moderated(*seen)[0] / seen[0]  # as loud as it is believed to be
        spread, rest = belief.moderated(*seen, drawn=loud * spread)
        directions = np.array([g.freedom[0] for g in own])
        found = blocks.normal_scores(loud * top / spread, directions, rest)
        out = np.maximum(out, np.max(found, axis=1))
    return out
