"""Models that lose something in each block: which cannot be told from the best, and how likely each
is the best."""

from __future__ import annotations

import numpy as np

from .deviations import standard_error

SAME = 1e-6  # of a loss: a difference below it is how numbers are rounded, or a solver's tolerance


def confidence_set(losses, rng: np.random.Generator, *, draws: int = 1000) -> np.ndarray:
    """(models,) p-values of the model confidence set: a model belongs to the set of confidence 1 -
    a where its p is above a.

    The worst model is left out while the hypothesis of equal losses is rejected; a model's p is the
    greatest p of the tests up to the one that left it out.

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


def chances(losses, rng: np.random.Generator, unit: float, *, draws: int = 4000) -> np.ndarray:
    """(models,) how likely each model is the one, over resampled blocks: by the likelihood of
    normal noise, exp(-loss / (2 unit)).

    Args:
        losses: (blocks, models) squared errors. unit: their variance, of one direction.

    Source: Yao, Vehtari, Simpson & Gelman 2018 (pseudo-BMA with the Bayesian bootstrap).
    """
    count = len(losses)
    drawn = count * rng.dirichlet(np.ones(count), draws) @ losses
    more = drawn - drawn.min(1, keepdims=True)
    likely = np.exp(-more / (2.0 * max(unit, 1e-300)))
    return (likely / likely.sum(1, keepdims=True)).mean(0)


def price(values: float) -> tuple[float, float]:
    """What a fitted number costs, and what one that may have either sign costs beside it, of
    squared errors of blocks held apart, in units of the variance of one direction.

    Blocks held apart ask who predicts best, and what holds the truth and more predicts about as
    well as the truth. Who is the truth is another question: a number then costs the logarithm of
    the count of independent `values`, of which holding apart has charged one; and one that may have
    either sign twice the logarithm of two, as half of what it could be lies on the other side.

    Source: Schwarz 1978.
    """
    return max(float(np.log(values)) - 1.0, 0.0), 2.0 * float(np.log(2.0))


def within_one_error(errors, best: int | None = None) -> np.ndarray:
    """(models,) bool: those that lose no more than the best by more than one standard error of the
    difference.

    Args:
        errors: (models, blocks) mean loss of each in blocks held apart. Of a single block no
            standard error can be told: the best is alone.
        best: which it is, where it is not the one of least mean.
    """
    errors = np.asarray(errors)
    difference = errors - errors[np.argmin(errors.mean(1)) if best is None else best]
    if errors.shape[1] < 2:
        return difference[:, 0] <= 0.0
    return difference.sum(1) <= standard_error(difference.T)
