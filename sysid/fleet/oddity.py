"""Odd in what: which single coefficient, or which body, accounts for a robot's deviation.

A deviation d of base parameters, with covariance V, is asked of each cause by itself: one
coefficient of an effect, or the ten parameters of a body (d = A theta). The cause whose chi-square
says most joins; what it does not account for is judged again, by the same threshold as the table,
until nothing stands out.

    theta = (A' V^-1 A)^-1 A' V^-1 d

V is between + within + the mean's own, with correlations over the robots drawn towards none as far
as few robots leave them uncertain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.special import gammaln

from ..inertia import PARAMETERS, UNITS
from .calibration import kept
from .coordinates import Coordinates

_SURE = 2.0  # deviations: a mass that is less clear is not what a body's change is named by
_FLAT = 1e-8  # of the largest singular value
_MOST = 5  # causes
_SAME = 0.95  # confidence at which another body would do as well


@dataclass(frozen=True)
class Cause:
    """A cause and what it comes to. name: `viscous.hip.Fv` or `link.m`; `body` is empty for a
    coefficient. size with its standard deviation, in the parameter's unit; values: every parameter
    of it with its deviation, {name: (value, std, unit)}; p: of what stood out before it joined;
    tied: other causes that would do as well."""

    name: str
    body: str
    size: float
    std: float
    unit: str
    values: dict[str, tuple[float, float, str]]
    p: float
    tied: tuple[str, ...]


def shrunk(rows: np.ndarray) -> np.ndarray:
    """The correlation (m, m) of `calibration.alike` rows (n, m), drawn towards none."""
    r = rows.T @ rows
    return np.eye(len(r)) + kept(rows) * (r - np.diag(np.diagonal(r)))


def causes(
    coordinates: Coordinates, deviation, covariance, std, p_of, threshold: float
) -> list[Cause]:
    """What accounts for a robot's deviation, the first cause first.

    Args:
        deviation: (base,), NaN where its logs tell nothing. covariance: (base, base) of it.
        std: (base,) that the table judged it by. p_of: (base,) z-scores -> p-values of the table.
    """
    told = np.isfinite(deviation) & np.isfinite(std)
    d, v = deviation[told], covariance[np.ix_(told, told)]
    groups = _groups(coordinates, told)
    white = np.linalg.solve(np.linalg.cholesky(v), np.column_stack([d, *groups.values()]))
    ends = np.cumsum([1, *(a.shape[1] for a in groups.values())])
    own = {key: white[:, a:b] for key, a, b in zip(groups, ends, ends[1:])}
    left, chosen, out, least = white[:, 0], [], [], None
    rest = d
    while len(chosen) < _MOST:
        z = np.full(len(deviation), np.nan)
        z[told] = rest / std[told]
        p = p_of(z)
        least = float(np.nanmin(p)) if np.isfinite(p).any() else 1.0
        if least > threshold:
            break
        taken = np.column_stack([own[key] for key in chosen]) if chosen else np.zeros((len(d), 0))
        base, _ = _range(taken)
        gains = {k: _gain(own[k], base, left) for k in own if k not in chosen}
        best = max(gains, key=lambda k: gains[k][0])
        if gains[best][2] <= 0.0:
            break
        enough = gains[best][2] - stats.chi2.ppf(_SAME, max(gains[best][1], 1))
        tied = tuple(k for k, g in gains.items() if k != best and g[2] >= enough)
        chosen.append(best)
        out.append((best, least, tied))
        whole = np.column_stack([own[key] for key in chosen])
        theta, spread = _solved(whole, white[:, 0])
        rest = d - np.column_stack([groups[key] for key in chosen]) @ theta
        left = white[:, 0] - whole @ theta
    if not chosen:
        return []
    return _told(coordinates, chosen, out, theta, spread, groups)


def weights_of(coordinates: Coordinates, body: str, word: str, between, variances) -> np.ndarray:
    """(base,) by which a deviation tells a parameter of a body, were that body alone to differ.

    Args:
        between: (base,). variances: (n, base); of robots whose logs are typical.
    """
    with np.errstate(invalid="ignore"):
        typical = between**2 + np.array([_median(v) for v in variances.T])
    told = np.isfinite(typical) & (typical > 0.0)
    columns = coordinates.of_body(coordinates.bodies.index(body))[told]
    scale = np.sqrt(typical[told])
    white = columns / scale[:, None]
    size = np.linalg.norm(white, axis=0)
    size = np.where(size > 0.0, size, 1.0)
    out = np.zeros(len(typical))
    k = PARAMETERS.index(word)
    out[told] = np.linalg.pinv(white / size, rcond=_FLAT)[k] / size[k] / scale
    return out


def _median(values) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else np.nan


def _groups(coordinates: Coordinates, told) -> dict[str, np.ndarray]:
    """{cause: its columns (told, k)}."""
    out = {}
    for k in coordinates.of_effects:
        if told[k]:
            out[coordinates.names[k]] = np.eye(coordinates.size)[told][:, [k]]
    for b, body in enumerate(coordinates.bodies):
        columns = coordinates.of_body(b)[told]
        if np.any(columns):
            out[body] = columns
    return out


def _range(columns) -> tuple[np.ndarray, int]:
    """An orthonormal basis of columns, each of the same size before; and its dimension."""
    size = np.linalg.norm(columns, axis=0)
    u, s, _ = np.linalg.svd(columns / np.where(size > 0.0, size, 1.0), full_matrices=False)
    count = int(np.sum(s > _FLAT * s[0])) if s.size else 0
    return u[:, :count], count


def _gain(columns, base, left) -> tuple[float, int, float]:
    """How improbable (-log p) what columns take of `left` is, beyond a basis; their dimension;
    what they take."""
    beyond = columns - base @ (base.T @ columns)
    basis, count = _range(beyond)
    taken = float(np.sum((basis.T @ left) ** 2))
    return -_log_tail(taken, max(count, 1)), count, taken


def _log_tail(taken: float, count: int) -> float:
    """log of the probability that a chi-square is beyond; by its leading term where it is less than
    any float."""
    found = float(stats.chi2.logsf(taken, count))
    if np.isfinite(found):
        return found
    return float((0.5 * count - 1.0) * np.log(0.5 * taken) - 0.5 * taken - gammaln(0.5 * count))


def _solved(columns, d) -> tuple[np.ndarray, np.ndarray]:
    """Least squares theta (k,) and its variances, NaN where the columns leave it open."""
    size = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(size > 0.0, size, 1.0)
    _, s, vt = np.linalg.svd(scaled, full_matrices=False)
    kept = s > _FLAT * s[0]
    inverse = (vt[kept].T / s[kept] ** 2) @ vt[kept]
    theta = inverse @ scaled.T @ d
    open_ = 1.0 - np.sum(vt[kept] ** 2, axis=0) > 1e-6
    variance = np.where(open_ | (size <= 0.0), np.nan, np.diagonal(inverse))
    scale = np.where(size > 0.0, size, 1.0)
    return theta / scale, variance / scale**2


def _told(coordinates, chosen, joined, theta, variance, groups) -> list[Cause]:
    out, first = [], 0
    units = dict(zip(coordinates.names, coordinates.units))
    for key, p, tied in joined:
        count = groups[key].shape[1]
        values, stds = theta[first : first + count], np.sqrt(variance[first : first + count])
        first += count
        if count == 1:
            own = {key: (float(values[0]), float(stds[0]), units[key])}
            out.append(Cause(key, "", *own[key], own, p, tied))
            continue
        own = {
            f"{key}.{word}": (float(v), float(s), unit)
            for word, v, s, unit in zip(PARAMETERS, values, stds, UNITS)
            if np.isfinite(s)
        }
        clear = {name: abs(v) / s for name, (v, s, _) in own.items()}
        mass = f"{key}.m"
        if not own:  # only sums of its parameters are told
            own = {mass: (float(values[0]), float("nan"), UNITS[0])}
        sure = not clear or clear.get(mass, 0.0) >= _SURE
        name = mass if sure else max(clear, key=lambda n: clear[n])
        out.append(Cause(name, key, *own[name], own, p, tied))
    return out
