"""How sure a sum over blocks is, or an estimate that blocks were left out of.

Source: White 1980; Cameron & Miller 2015 (clustered scores).
"""

from __future__ import annotations

import numpy as np

from .. import eigen
from .numbering import numbered, summed

RESTING = 5.0  # blocks that a test must rest on
LEVERAGE = 0.9  # of a direction: what one block may hold of it


def standard_error(values):
    """Standard error of the sum of values (blocks, ...) about zero change; NaN of a single
    block."""
    values = np.asarray(values)
    count = len(values)
    if count < 2:
        return np.full(values.shape[1:], np.nan)[()]
    return np.sqrt(count * np.var(values, axis=0, ddof=1))


def averaged(values, blocks: int) -> tuple[float, float]:
    """Mean of values (n,) that stand in order of time, and its standard error by so many blocks."""
    at = np.arange(len(values))
    number = numbered(at, np.zeros_like(at), shortest=np.inf, fewest=blocks)
    means = summed(number, values) / np.bincount(number)
    return float(np.mean(values)), float(standard_error(means)) / len(means)


def z_score(differences) -> float:
    """Standard errors that a sum over blocks stands from zero; neighbouring blocks count together.
    Zero where they are too few."""
    d = np.asarray(differences)
    if len(d) > 7:
        d = d[: len(d) // 2 * 2].reshape(-1, 2).sum(1)
    se = standard_error(d) if len(d) > 2 else 0.0
    return float(d.sum() / se) if se > 0 else 0.0


def slope_chance(told, values, number, *, mutual: bool = False) -> float:
    """Probability, were nothing there, of a slope of values (n,) on what was told of them (n,) as
    large as theirs: Student's t of sums over blocks `number` (n,), with what the slope leaves as
    their noise.

    Args:
        mutual: blocks are told by each other. What two of them share, the product of their noises
            by what tells the one of the other, then stands in the sums of both: their variances
            add to half of the whole's.

    Source: MacKinnon & White 1985 (the jackknife's deviation); Serfling 1980, 5.5 (degenerate
        U-statistics).
    """
    from scipy.special import stdtr  # not scipy.stats, whose import alone takes longer than a fit

    size = summed(number, told * told)
    if not size.sum() > 0:
        return 1.0
    slope = float(told @ values / size.sum())
    left = summed(number, told * (values - slope * told))
    acting = size.sum() ** 2 / np.sum(size**2)
    # each block against the slope of all others: where few act, each bends it towards itself
    spread = np.sqrt(np.sum((left / np.maximum(1.0 - size / size.sum(), 1e-9)) ** 2))
    spread *= np.sqrt(2.0) if mutual else 1.0
    return float(stdtr(max(acting - 1.0, 1.0), -slope * size.sum() / max(spread, 1e-300)))


def jackknife(without) -> np.ndarray:
    """Standard errors of estimates from those with one block left out each (blocks, ...)."""
    without = np.asarray(without)
    count = len(without)
    return np.sqrt((count - 1) / count * ((without - without.mean(0)) ** 2).sum(0))


def resting(squares: np.ndarray) -> np.ndarray:
    """On how many blocks (...) something rests: one over the sum of squared shares (..., blocks, k,
    k)."""
    share = np.einsum("...bkk->...b", squares)
    return share.sum(-1) ** 2 / np.maximum(np.sum(share**2, axis=-1), 1e-300)


def many(squares: np.ndarray) -> np.ndarray:
    """Whether something rests on enough blocks (...) to be told from chance, no direction of it on
    nearly one alone, by its shares (..., blocks, k, k)."""
    most = np.linalg.eigvalsh(squares).max(axis=(-1, -2))
    return (resting(squares) >= RESTING) & (most <= LEVERAGE)


def evening(share: np.ndarray) -> np.ndarray:
    """Weights of blocks by their shares (blocks,), under which twice the fewest take part: no block
    counts more than the rest allows."""
    share = np.maximum(share, 0.0)  # rounding leaves less of what a block has nothing of
    return np.minimum(1.0, even(share, 2.0 * RESTING) / np.maximum(share, 1e-300))


def even(share: np.ndarray, parts: float) -> float:
    """What no block's share (blocks,) may pass for none to hold more than an even one of so many
    parts."""
    ascending = np.sort(share)
    below = np.concatenate([[0.0], np.cumsum(ascending)])
    count = len(share) - np.arange(len(share))
    capped = below[:-1] + count * ascending  # of all, where each in turn is the most
    fits = ascending <= capped / parts
    if fits.all():
        return float(ascending[-1])
    k = int(np.argmin(fits))  # the first that is too much: between its neighbour below and it
    rest = parts - count[k]
    return float(below[k] / rest) if rest > 0 else float(ascending[k])


def shared(squares: np.ndarray, most: float) -> np.ndarray:
    """(k, l) the directions of squares (blocks, k, k) that sum to one, without those of which one
    block holds more than `most`."""
    turn = np.eye(squares.shape[1])
    while turn.shape[1]:
        values, vectors = eigen.symmetric(turn.T @ squares @ turn)
        if values.max() <= most:
            break
        turn = turn @ vectors[int(np.argmax(values[:, -1]))][:, :-1]
    return turn
