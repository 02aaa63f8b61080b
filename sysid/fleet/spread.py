"""How far the robots' values lie apart, and how far each lies from all others: random effects.

    value_i = mean + between_i + within_i,    var = between^2 + variance_i

For each parameter by itself. The start is robust: the median, and the spread under which the median
of the squared deviations is what it is under a normal law. Robots beyond three deviations, more
where few robots leave that spread uncertain, are then left out, and moments of the others, weighed
at the start's spread, give mean and spread. Each robot is judged by the others: it is taken out of
these sums, which is exact and costs nothing.

Source: DerSimonian & Kacker 2007 (moments of any weights, the two-step estimator); Higgins,
Thompson & Spiegelhalter 2009 (the predictive distribution, Student's law).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

MIDDLE = float(stats.chi2.ppf(0.5, 1))  # half of the squares of a normal variable lie below it
# The median of squares tells a variance as well as this share of so many squares would: the
# efficiency of the median absolute deviation.
EFFICIENCY = 0.37
_BEYOND = float(stats.norm.sf(3.0))  # one-sided: of sound robots so many are left out, few or many
_HALVINGS = 24  # of the variance's range: as near as a start need be


@dataclass(frozen=True)
class Spread:
    """Of each parameter (m,): mean, its variance, between (the standard deviation of the robots
    themselves), how many robots count. typical: (n, m) bool, robots that count."""

    mean: np.ndarray
    variance: np.ndarray
    between: np.ndarray
    count: np.ndarray
    typical: np.ndarray


@dataclass(frozen=True)
class Judged:
    """Each robot by the others, (n, m): its deviation from their mean, the standard deviation that
    it should have, and the probability (two-sided) of one as large; NaN where none can be told."""

    deviation: np.ndarray
    std: np.ndarray
    p: np.ndarray

    @property
    def z(self) -> np.ndarray:
        """(n, m) deviations in standard deviations."""
        return self.deviation / self.std


def start(values, variances) -> tuple[np.ndarray, np.ndarray]:
    """Median (m,) of values (n, m), and the variance (m,) between robots by the median square."""
    nobody = ~np.isfinite(values).any(axis=0)
    values, variances = np.where(nobody, 0.0, values), np.where(nobody, 1.0, variances)
    middle = _median(values)
    squares = (values - middle) ** 2
    low, high = np.zeros(middle.shape), np.nanmax(squares, axis=0) / MIDDLE + 1e-300
    spare = _median(squares / variances) <= MIDDLE
    for _ in range(_HALVINGS):
        half = 0.5 * (low + high)
        above = _median(squares / (variances + half)) > MIDDLE
        low, high = np.where(above, half, low), np.where(above, high, half)
    return middle, np.where(spare, 0.0, 0.5 * (low + high))


@dataclass(frozen=True)
class _Sums:
    """Sums over robots (m,), or over all but one (n, m)."""

    weight: np.ndarray
    value: np.ndarray
    square: np.ndarray
    weight2: np.ndarray
    noise: np.ndarray
    noise2: np.ndarray
    count: np.ndarray

    def settled(self):
        """Mean, its variance, and the variance between."""
        mean = self.value / self.weight
        q = self.square - self.value * mean
        expected = self.noise - self.noise2 / self.weight
        free = self.weight - self.weight2 / self.weight
        between = np.maximum((q - expected) / free, 0.0)
        return mean, (self.noise2 + between * self.weight2) / self.weight**2, between


def _parts(values, variances, first, typical):
    """What the sums are of, (n, m) each."""
    w = np.where(typical, 1.0 / (variances + first), 0.0)
    b, v = np.where(typical, values, 0.0), np.where(typical, variances, 0.0)
    return w, w * b, w * b**2, w**2, w * v, w**2 * v, typical.astype(float)


def _prepared(values, variances):
    middle, first = start(values, variances)
    # no spread at all, as of a parameter that is given: any is beyond it
    least = 1e-24 * np.maximum(middle**2, 1e-200)
    variances = np.maximum(variances, least)
    freedom = EFFICIENCY * np.maximum(np.isfinite(values).sum(axis=0) - 1.0, 1.0)
    far = stats.t.isf(_BEYOND, freedom)
    with np.errstate(invalid="ignore"):
        typical = np.abs(values - middle) <= far * np.sqrt(variances + first)
    return middle, _parts(values - middle, variances, first, typical), typical, variances


def spread(values, variances) -> Spread:
    """The robots' mean and spread.

    Args:
        values: (n, m), NaN where a robot's logs do not tell one. variances: (n, m).
    """
    middle, parts, typical, _ = _prepared(values, variances)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean, error, between = _Sums(*(p.sum(axis=0) for p in parts)).settled()
    return Spread(middle + mean, error, np.sqrt(between), typical.sum(axis=0), typical)


def judged(values, variances) -> Judged:
    """Each robot by all others. Args: as of `spread`."""
    middle, parts, _, variances = _prepared(values, variances)
    with np.errstate(invalid="ignore", divide="ignore"):
        sums = _Sums(*(p.sum(axis=0) - p for p in parts))
        mean, error, between = sums.settled()
        deviation = values - middle - mean
        std = np.sqrt(variances + between + error)
        freedom = sums.count - 1.0
        p = 2.0 * stats.t.sf(np.abs(deviation / std), np.maximum(freedom, 1.0))
    told = np.isfinite(values) & (freedom >= 1.0)
    nothing = lambda x: np.where(told, x, np.nan)  # noqa: E731
    return Judged(nothing(deviation), nothing(std), nothing(p))


def inflation(apart, variances) -> np.ndarray:
    """By how much (..., m) the variances of two sets of logs of one robot fall short of how far
    their values lie apart, at least one.

    Each parameter's factor, by the median over robots, is drawn to the typical factor as far as
    it is uncertain beside how much the factors differ.

    Args:
        apart: (n, ..., m) differences. variances: (n, ..., m) that these should have.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        squares = (apart**2 / variances).reshape(len(apart), -1, apart.shape[-1])
    told = np.isfinite(squares)
    squares[~told] = np.nan
    count = told.sum(axis=0)
    own = _median(np.where(count > 0, squares, MIDDLE)) / MIDDLE
    known = (count > 0) & (own > 0.0)
    logs = np.where(known, np.log(np.where(known, own, 1.0)), np.nan).T
    errors = 2.0 / (EFFICIENCY * np.maximum(count.T, 1))
    found = spread(logs, errors)
    middle = np.where(np.isfinite(found.mean), found.mean, 0.0)
    between = np.nan_to_num(found.between) ** 2
    share = np.where(found.typical, between / (between + errors), 1.0)
    out = np.exp(middle + np.where(known.T, share * (logs - middle), 0.0))
    return np.maximum(out.T.reshape(apart.shape[1:]), 1.0)


def _median(values) -> np.ndarray:
    return (np.median if np.isfinite(values).all() else np.nanmedian)(values, axis=0)
