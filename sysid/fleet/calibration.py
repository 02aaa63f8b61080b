"""The one threshold of the table: how small the least of all probabilities is by chance.

Fleets without an odd robot are drawn as the fleet at hand was found to be, and go through the same
arithmetic: the inflation of the stated deviations, the robust start, the robots that are left out,
each robot judged by the others. The least p-value of each drawn table is kept; the threshold is
their quantile at the false-alarm rate. What the parameters have in common, and that spreads are
themselves found from the fleet, is so allowed for.

Source: Westfall & Young 1993 (the least p-value of dependent tests).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .spread import Spread, inflation, judged

DRAWS = 1000
_NUMBERS = 2e9  # random numbers that a calibration may take: a large fleet has fewer draws
_FEWEST = 200
_TOGETHER = 200_000  # numbers of drawn tables that stand in memory at once


@dataclass(frozen=True)
class Table:
    """What the robots' logs say, (n, m) each: `values` by the training logs, `variances` as stated;
    `again` and `variances_again` by the test logs, NaN where these tell nothing. roots (n, m, m):
    of the stated covariance of `values`."""

    values: np.ndarray
    variances: np.ndarray
    again: np.ndarray
    variances_again: np.ndarray
    roots: np.ndarray

    def inflated(self) -> np.ndarray:
        """(m,) by how much the stated variances fall short."""
        return inflation(self.values - self.again, self.variances + self.variances_again)


def threshold(
    table: Table, found: Spread, factor: np.ndarray, rate: float, rng: np.random.Generator
) -> float:
    """The p-value that the least of a table of a fleet without an odd robot is below at a rate.

    Args:
        found: of the fleet. factor: (m,) `table.inflated()`. rate: of false alarms in a table.
    """
    n, m = table.values.shape
    draws = int(np.clip(_NUMBERS / (n * m * m), _FEWEST, DRAWS))
    told = np.isfinite(table.values)[:, None]
    likeness = alike(table, found, factor)
    common, alone = np.sqrt(kept(likeness)), np.sqrt(1.0 - kept(likeness))
    scale, again = np.sqrt(factor), np.sqrt(factor * table.variances_again)[:, None]
    stated = np.where(told[:, 0], table.variances, np.nan)
    typical = np.array([_median(v) for v in (stated * factor).T])
    total, freedom = found.between**2 + typical, np.maximum(found.count - 1.0, 1.0)
    least: list[np.ndarray] = []
    while (done := sum(map(len, least))) < draws:
        d = min(max(1, _TOGETHER // (n * m)), draws - done)
        # few robots leave their spread uncertain
        spare = np.sqrt(np.maximum(total * freedom / rng.chisquare(freedom, (d, m)) - typical, 0.0))
        likes = common * (rng.standard_normal((n, d, n)) @ likeness)
        between = spare * (likes + alone * rng.standard_normal((n, d, m)))
        noise = np.einsum("nij,ndj->ndi", table.roots, rng.standard_normal((n, d, m))) * scale
        values = np.where(told, between + noise, np.nan)
        other = between + again * rng.standard_normal((n, d, m))
        wide = np.broadcast_to(table.variances[:, None], values.shape)
        both = wide + table.variances_again[:, None]
        wide = wide * inflation(values - other, both)
        p = judged(values.reshape(n, -1), wide.reshape(n, -1)).p.reshape(n, d, m)
        least.append(np.where(np.isfinite(p), p, 1.0).min(axis=(0, 2)))
    return float(np.quantile(np.concatenate(least), rate, method="lower"))


def _median(values) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else np.nan


def alike(table: Table, found: Spread, factor) -> np.ndarray:
    """Rows (n, m) whose products are the correlation of the parameters over typical robots."""
    spare = np.sqrt(table.variances * factor + found.between**2)
    with np.errstate(invalid="ignore", divide="ignore"):
        own = np.where(found.typical, (table.values - found.mean) / spare, 0.0)
    size = np.sqrt((own**2).sum(axis=0))
    return own / np.where(size > 0.0, size, 1.0)


def kept(rows: np.ndarray) -> float:
    """Which share of the squared correlations of `alike` rows (n, m) is not the chance of few
    robots, which makes 1 / (n - 1) of each that is none.

    Source: Ezekiel 1930 (the adjusted square).
    """
    n, r = len(rows), rows.T @ rows
    off = (r**2)[~np.eye(len(r), dtype=bool)]
    square = float(off.mean()) if off.size else 0.0
    if n < 3 or square <= 0.0:
        return 0.0
    return float(np.clip((square * (n - 1) - 1.0) / (n - 2) / square, 0.0, 1.0))
