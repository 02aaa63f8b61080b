"""The combinations of parameters that a log determines, where single ones cannot be told.

A robot's regressor has columns that are exact combinations of others, whatever the motion: no log
tells such parameters one by one, only sums of them. The columns are taken in an order, here from
the base outwards and within a body masses last; one that those before it make up is left out, and
its parameter joins theirs. Each column that stays is then one combination, and its value with its
standard deviation is what the log says, whatever the prior believes of the single parameters.

Source: Gautier 1991 (numerical calculation of the base inertial parameters); Khalil & Dombre 2002.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .estimate import Fit
from .inertia import PARAMETERS

# Of a column's length: what stays of it beside those before it is rounding below. The triangle
# holds columns to the rounding of a QR; its root parts the two, as for any rank of products.
_ALIKE = float(np.sqrt(np.finfo(float).eps))
_NAMED = 1e-6  # of the largest factor: less is rounding, and is not named
_ORDER = ("hx", "hy", "hz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz", "m")
CLEAR = 2.0  # standard deviations from zero


@dataclass(frozen=True)
class Combination:
    """A sum of parameters that the log tells apart from all others.

    terms: (parameter's name, factor) each, the first with factor 1. value with std, NaN where
    nothing is known of it, in the first parameter's unit.
    """

    terms: tuple[tuple[str, float], ...]
    value: float
    std: float
    unit: str

    @property
    def clear(self) -> bool:
        """Whether it is told from zero."""
        return bool(np.isfinite(self.std)) and abs(self.value) > CLEAR * self.std

    @property
    def words(self) -> str:
        """The sum, written out."""
        first, *rest = self.terms
        return first[0] + "".join(
            f" {'+' if factor > 0 else '−'} {_factor(abs(factor))}{name}" for name, factor in rest
        )


@dataclass(frozen=True)
class Correlation:
    """Two parameters whose errors go together: `value` from -1 to 1."""

    first: str
    second: str
    value: float


def combinations(fit: Fit) -> tuple[Combination, ...]:
    """The combinations with inertial parameters that a fit's training logs determine, from the base
    outwards."""
    size, bodies = fit.model.size, 10 * fit.model.bodies
    columns = fit.compressed.total(fit.weights)[:, :size]
    length = np.linalg.norm(columns, axis=0)
    seen = [k for k in _ordered(fit.model.bodies, size) if length[k] > _ALIKE * length.max()]
    kept, left = independent(columns / np.where(length > 0.0, length, 1.0), seen, _ALIKE)
    factors = np.zeros((len(kept), size))
    factors[np.arange(len(kept)), kept] = 1.0
    if left:
        factors[:, left] = np.linalg.lstsq(columns[:, kept], columns[:, left], rcond=None)[0]
    # a factor counts by what it makes of torque, not by its unit
    made = np.abs(factors) * length / length[kept][:, None]
    factors[made < _NAMED] = 0.0
    covariance = np.nan_to_num(fit.uncertainty.covariance)
    out = []
    for k, own in zip(kept, factors):
        used = np.flatnonzero(own)
        if not (used < bodies).any():
            continue  # of effects alone: these stand by themselves
        known = np.isfinite(fit.uncertainty.std[k])
        std = float(np.sqrt(max(own @ covariance @ own, 0.0))) if known else float("nan")
        rest = [j for j in used if j != k]
        terms = tuple((fit.model.names[j], float(own[j])) for j in (k, *rest))
        out.append(Combination(terms, float(own @ fit.x), std, fit.model.units[k]))
    return tuple(out)


def correlations(fit: Fit, most: int = 12) -> tuple[list[str], np.ndarray]:
    """The parameters that the data tell whose errors go together most.

    Returns:
        their names, at most so many, and their correlations (k, k).
    """
    told = np.flatnonzero((fit.uncertainty.from_data > 0.5) & np.isfinite(fit.uncertainty.std))
    spread = fit.uncertainty.std[told]
    told, spread = told[spread > 0.0], spread[spread > 0.0]
    if len(told) < 2:
        return [], np.zeros((0, 0))
    found = fit.uncertainty.covariance[np.ix_(told, told)] / np.outer(spread, spread)
    found = np.clip(found, -1.0, 1.0)
    apart = np.abs(found - np.diag(np.diagonal(found)))
    chosen: list[int] = []
    for at in np.argsort(-apart, axis=None):
        chosen += [k for k in map(int, np.unravel_index(at, apart.shape)) if k not in chosen]
        if len(chosen) >= most:
            break
    chosen = sorted(chosen[:most])
    return [fit.model.names[told[k]] for k in chosen], found[np.ix_(chosen, chosen)]


def strongest(names: list[str], found: np.ndarray, most: int = 5) -> list[Correlation]:
    """The pairs whose errors go together most, as `correlations` has them."""
    pairs = [
        Correlation(names[i], names[j], float(found[i, j]))
        for i in range(len(names))
        for j in range(i)
    ]
    return sorted(pairs, key=lambda pair: -abs(pair.value))[:most]


def _ordered(bodies: int, size: int) -> list[int]:
    """Columns in the order in which they may stay: effects, then bodies from the base outwards."""
    own = [PARAMETERS.index(name) for name in _ORDER]
    return [*range(10 * bodies, size), *(10 * b + k for b in range(bodies) for k in own)]


def independent(columns: np.ndarray, order, alike: float) -> tuple[list[int], list[int]]:
    """Which columns (n, k) of unit length stay, and which others make up, in an order
    (Gram-Schmidt, twice is enough).

    Args:
        alike: what is left of a column beside those before it, and is rounding.
    """
    basis = np.empty((len(columns), len(order)), order="F")
    kept, left = [], []
    for k in map(int, order):
        known, rest = basis[:, : len(kept)], columns[:, k]
        for _ in range(2):
            rest = rest - known @ (known.T @ rest)
        size = float(np.linalg.norm(rest))
        if size > alike:
            basis[:, len(kept)] = rest / size
            kept.append(k)
        else:
            left.append(k)
    return kept, left


def _factor(value: float) -> str:
    return "" if abs(value - 1.0) < 1e-9 else f"{value:.4g} "
