"""Blocks of time, and what is said with them: the one place of the package where standard errors of correlated rows are made.

Neighbouring rows of a filtered signal say the same thing twice. So rows are summed over blocks of time that are long
against every memory in them (the filter's, the noise's), and blocks are what is counted, left out and resampled.

Source: White 1980; Cameron & Miller 2015 (clustered scores); Liu 1988, Davidson & Flachaire 2008 (signs);
Hansen, Lunde & Nason 2011 (confidence set of models).
"""

from __future__ import annotations

import numpy as np

SHORTEST = 0.5  # s: several times the memory of the filters in use (0.05 to 0.1 s) and of a joint's friction loop
FEWEST, MOST = 12, 60  # below, no spread can be told; above, nothing is gained
SAME = 1e-6  # of a loss: a difference below it is how numbers are rounded, or a solver's tolerance
_TIMES = 4.0  # memories in a block: of a first-order noise, what stands across two blocks is then an eighth of its variance


def numbered(t, piece, *, memory: float = 0.0, shortest: float = SHORTEST, fewest: int = FEWEST) -> np.ndarray:
    """The block (n,) of each row: stretches of equal length within each piece, none across two pieces.

    Args:
        t: (n,) [s], ascending within a piece. piece: (n,) number of the contiguous piece of each row.
        memory: seconds over which rows say the same thing. shortest: seconds of a block, unless fewer than `fewest` blocks
            came of it.
    """
    out, first = np.zeros(len(t), dtype=int), 0
    pieces = [np.flatnonzero(piece == number) for number in np.unique(piece)]
    spans = [t[own[-1]] - t[own[0]] for own in pieces]
    total = sum(spans)
    length = min(max(total / MOST, shortest, _TIMES * memory), max(total / fewest, 1e-9))
    for own, span in zip(pieces, spans):
        count = max(1, round(span / length))
        where = ((t[own] - t[own[0]]) * (count / max(span, 1e-9))).astype(int)
        out[own] = first + np.minimum(where, count - 1)
        first += count
    return out


def memory(values, use, piece, step: float) -> float:
    """Seconds over which values (n, k) at rows `step` seconds apart stay alike: the sum of their autocorrelation up to where it
    has gone, the longest of all columns.

    Args:
        use: (n, k) bool, rows that count. piece: (n,) number of the contiguous piece of each row.
    """
    n = len(values)
    kept = np.where(use, values, 0.0)
    lags = min(n // 4, int(2.0 / step))
    size = 1 << (2 * n).bit_length()
    number = np.unique(piece, return_inverse=True)[1]
    products, pairs = np.zeros((lags, values.shape[1])), np.zeros((lags, values.shape[1]))
    for k in range(number.max() + 1):
        own = number == k
        for out, x in ((products, kept[own]), (pairs, use[own].astype(float))):
            power = np.abs(np.fft.rfft(x, size, axis=0)) ** 2
            found = np.fft.irfft(power, axis=0)[: min(lags, own.sum())]
            out[: len(found)] += found
    alike = np.divide(products, pairs, out=np.zeros_like(products), where=pairs > 0.5)
    alike = alike / np.where(alike[:1] > 0, alike[:1], 1.0)
    gone = np.where((alike < 0.1).any(0), np.argmax(alike < 0.1, axis=0), lags)
    sums = [step * (0.5 + alike[1:last, j].sum()) for j, last in enumerate(gone) if use[:, j].any()]
    return float(max(sums, default=0.0))


def summed(blocks, values, size: int | None = None) -> np.ndarray:
    """Sums (blocks, ...) of values (n, ...) over rows whose block is `blocks` (n,), ascending or not."""
    values = np.asarray(values)
    size = int(blocks.max()) + 1 if size is None else size
    flat = values.reshape(len(values), -1)
    if not flat.shape[1]:
        return np.zeros((size, *values.shape[1:]))
    out = np.stack([np.bincount(blocks, v, minlength=size) for v in flat.T], 1)
    return out.reshape(size, *values.shape[1:])


def folds(count: int, most: int = 10) -> np.ndarray:
    """The fold (count,) of each block: neighbours together."""
    return np.arange(count) * min(most, count) // count


def standard_error(values) -> float:
    """Standard error of the sum of values (blocks,) about zero change."""
    count = len(values)
    return float(np.sqrt(count * np.var(values, ddof=1))) if count > 1 else float("nan")


def away(differences) -> float:
    """Standard errors that a sum over blocks stands from zero; neighbouring blocks count together. Zero where they are too few."""
    d = np.asarray(differences)
    if len(d) > 7:
        d = d[: len(d) // 2 * 2].reshape(-1, 2).sum(1)
    se = standard_error(d) if len(d) > 2 else 0.0
    return float(d.sum() / se) if se > 0 else 0.0


def slope_chance(told, values, number) -> float:
    """Probability, were nothing there, of a slope of values (n,) on what was told of them (n,) as large as theirs: Student's t of
    sums over blocks `number` (n,), with what the slope leaves as their noise."""
    from scipy.special import stdtr  # not scipy.stats, whose import alone takes longer than a fit

    size = summed(number, told * told)
    if not size.sum() > 0:
        return 1.0
    slope = float(told @ values / size.sum())
    left = summed(number, told * (values - slope * told))
    acting = size.sum() ** 2 / np.sum(size**2)
    spread = np.sqrt(np.sum(left**2) * len(left) / max(len(left) - 1, 1))
    return float(stdtr(max(acting - 1.0, 1.0), -slope * size.sum() / max(spread, 1e-300)))


def jackknife(without) -> np.ndarray:
    """Standard errors of estimates from those with one block left out each (blocks, ...)."""
    without = np.asarray(without)
    count = len(without)
    return np.sqrt((count - 1) / count * ((without - without.mean(0)) ** 2).sum(0))


def signs(count: int, draws: int, rng: np.random.Generator) -> np.ndarray:
    """Random signs (draws, count)."""
    return rng.integers(0, 2, (draws, count)) * 2.0 - 1.0


def confidence_set(losses, rng: np.random.Generator, *, draws: int = 1000) -> np.ndarray:
    """(models,) p-values of the model confidence set: a model belongs to the set of confidence 1 - a where its p is above a.

    The worst model is left out while the hypothesis of equal losses is rejected; a model's p is the greatest p of the tests
    up to the one that left it out.

    Args:
        losses: (blocks, models), what each model loses in each block.

    Source: Hansen, Lunde & Nason 2011, with the range statistic over single models (T_max).
    """
    blocks, models = losses.shape
    p, left, greatest = np.ones(models), list(range(models)), 0.0
    weights = rng.multinomial(blocks, np.full(blocks, 1.0 / blocks), draws) / blocks
    while len(left) > 1:
        own = losses[:, left]
        apart = own - own.mean(1, keepdims=True)
        mean = apart.mean(0)
        if np.abs(mean).max() <= SAME * np.abs(own).mean():
            p[left] = 1.0  # rounding is always on the same side, and no evidence
            break
        drawn = weights @ apart - mean
        spread = np.sqrt(np.maximum((drawn**2).mean(0), 1e-300))
        worst = int(np.argmax(mean / spread))
        found = float(np.mean((drawn / spread).max(1) >= (mean / spread).max()))
        greatest = max(greatest, found)
        p[left[worst]] = greatest
        left.pop(worst)
    if left:
        p[left[0]] = 1.0
    return p


def chances(losses, rng: np.random.Generator, *, draws: int = 4000) -> np.ndarray:
    """(models,) how often each model loses least over resampled blocks.

    Source: Yao, Vehtari, Simpson & Gelman 2018 (pseudo-BMA with the Bayesian bootstrap).
    """
    drawn = rng.dirichlet(np.ones(len(losses)), draws) @ losses
    least = drawn.min(1, keepdims=True)
    best = drawn <= least + SAME * np.abs(least)  # what is the same, but for rounding, shares
    return (best / best.sum(1, keepdims=True)).mean(0)
