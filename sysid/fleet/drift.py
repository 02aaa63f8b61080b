"""How parameters move with the dates of the logs: a line through typical robots.

    value_i = a + slope * date_i + between_i + within_i

weighed by between and within; the slope's standard deviation is that of the values about the line
themselves, at least what they should have, and Student's law judges it.

Source: Knapp & Hartung 2003 (regression of random effects).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from .spread import Spread

YEAR = 365.25  # days
_FEWEST = 4  # dates


@dataclass(frozen=True)
class Drift:
    """Of each parameter (m,): the change a year, its standard deviation, its probability; NaN
    where there are too few dates."""

    slope: np.ndarray
    std: np.ndarray
    p: np.ndarray


def drift(dates, values, variances, found: Spread) -> Drift | None:
    """The lines of parameters over dates, None where fewer than four are known.

    Args:
        dates: (n,) days, NaN where unknown. values, variances: (n, m). found: their spread.
    """
    known = np.isfinite(dates)
    if len(np.unique(np.floor(dates[known]))) < _FEWEST:
        return None
    t = np.where(known, dates, 0.0) / YEAR
    use = found.typical & known[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        w = np.where(use, 1.0 / (variances + found.between**2), 0.0)
        b = np.where(use, values, 0.0)
        total = w.sum(axis=0)
        away = np.where(use, t[:, None] - (w * t[:, None]).sum(axis=0) / total, 0.0)
        level = np.where(use, b - (w * b).sum(axis=0) / total, 0.0)
        square = (w * away**2).sum(axis=0)
        slope = (w * away * level).sum(axis=0) / square
        freedom = use.sum(axis=0) - 2.0
        left = (w * (level - slope * away) ** 2).sum(axis=0) / freedom
        std = np.sqrt(np.maximum(left, 1.0) / square)
        p = 2.0 * stats.t.sf(np.abs(slope / std), np.maximum(freedom, 1.0))
    told = (freedom >= 1.0) & np.isfinite(std)
    return Drift(*(np.where(told, x, np.nan) for x in (slope, std, p)))
