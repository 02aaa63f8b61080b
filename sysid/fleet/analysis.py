"""Experiments of one type of robot -> what they share, what differs, which one is odd and in what.

    each experiment -> fit, and its base parameters with covariance
    train against test -> how far the stated deviations fall short
    all -> mean and spread, drift over dates, each robot judged by the others
    fleets drawn like this one -> the threshold of the whole table
    an odd robot's deviation -> the coefficients or the bodies that account for it

Three questions are asked of every parameter: whether it differs from robot to robot, whether it
moves with the dates, which robot is odd in it. Each has an equal part of the rate of false alarms.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from ..projection import root
from .calibration import Table, alike, threshold
from .coordinates import Coordinates
from .drift import Drift, drift
from .members import Kind, Member
from .oddity import Cause, causes, shrunk
from .spread import EFFICIENCY, Judged, Spread, judged, spread

RATE = 0.05
FEWEST = 3  # robots: of two, none is the odd one


@dataclass(frozen=True)
class Fleet:
    """What was found. rate: of false alarms in the whole table; threshold: p-value below which a
    robot is odd. inflation (base,): what the stated variances were multiplied with. differs (base,)
    p-values of equal parameters. odd: {robot's number: causes}. mean_rms: (n, joints) of the
    fleet's mean on each robot's test logs. failed: [(experiment, why)]."""

    kind: Kind
    members: tuple[Member, ...]
    failed: tuple[tuple[str, str], ...]
    rate: float
    threshold: float
    inflation: np.ndarray
    spread: Spread
    judged: Judged
    differs: np.ndarray
    drift: Drift | None
    odd: dict[int, list[Cause]]
    mean_rms: np.ndarray
    values: np.ndarray
    variances: np.ndarray

    @property
    def coordinates(self) -> Coordinates:
        """The base parameters."""
        return self.kind.coordinates

    def __repr__(self) -> str:
        odd = "; ".join(
            f"{self.members[i].name} in {', '.join(c.name for c in found)}"
            for i, found in self.odd.items()
        )
        return f"<Fleet of {len(self.members)}: {odd or 'none is odd'}>"

    @property
    def questions(self) -> int:
        """How many share the rate: differences, oddity, and drift where there are dates."""
        return 2 + (self.drift is not None)


def analysed(
    kind: Kind, members: list[Member], failed=(), *, rate: float = RATE, seed: int = 0
) -> Fleet:
    """What members of one kind say together.

    Args:
        failed: [(experiment, why)] of those that are not among them. rate: of false alarms in the
            whole table. seed: of the fleets that are drawn.
    """
    table, factor = _table(members)
    variances = table.variances * factor
    found = spread(table.values, variances)
    days = np.array([np.nan if m.date is None else m.date.days for m in members])
    moved = drift(days, table.values, variances, found)
    part = rate / (2 + (moved is not None))
    level = part / kind.coordinates.size
    table = _without_drift(table, days, moved, level)
    found = spread(table.values, variances)
    by_others = judged(table.values, variances)
    least = threshold(table, found, factor, part, np.random.default_rng(seed))
    odd = _odd(kind, members, table, factor, found, by_others, least)
    mean = np.nan_to_num(found.mean)  # what nobody's logs tell moves nobody's torque
    rms = np.array(
        [np.sqrt(m.held_out.squares(mean) / np.maximum(m.held_out.rows, 1)) for m in members]
    )
    return Fleet(
        kind, tuple(members), tuple(failed), rate, least, factor, found, by_others,
        _different(table.values, variances), moved, odd, rms, table.values, variances,
    )  # fmt: skip


def _table(members: list[Member]) -> tuple[Table, np.ndarray]:
    """The table of a fleet, its stated variances those of correlated noise; and their inflation."""
    stack = lambda pick: np.array([pick(m) for m in members])  # noqa: E731
    values, again = stack(lambda m: m.train.values), stack(lambda m: m.test.values)
    told = np.isfinite(values).sum(axis=0) >= FEWEST
    values = np.where(told, values, np.nan)
    wide = _typical(stack(lambda m: m.train.widened))
    covariance = stack(lambda m: m.train.covariance) * np.sqrt(np.outer(wide, wide))
    covariance *= (told[:, None] & told)[None]
    variances = np.where(told, stack(lambda m: m.train.variance) * wide, np.nan)
    other = stack(lambda m: m.test.variance) * _typical(stack(lambda m: m.test.widened))
    table = Table(values, variances, again, other, np.array([root(c) for c in covariance]))
    return table, table.inflated()


def _typical(widened) -> np.ndarray:
    """By how much (m,) noise's memory widens each variance: the mean over the robots."""
    known = np.isfinite(widened)
    mean = np.where(known, widened, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return np.maximum(mean, 1.0)


def _without_drift(table: Table, days, moved: Drift | None, level: float) -> Table:
    """The values without the lines that dates tell."""
    if moved is None:
        return table
    with np.errstate(invalid="ignore"):
        slope = np.where(moved.p < level, moved.slope, 0.0)
    since = np.where(np.isfinite(days), days - np.nanmean(days), 0.0) / 365.25
    line = since[:, None] * np.nan_to_num(slope)
    return replace(table, values=table.values - line, again=table.again - line)


def _different(values, variances) -> np.ndarray:
    """(m,) p-values of equal values: their weighted squares against F, as the deviations' inflation
    is itself known from the robots' number. Source: Cochran 1954."""
    with np.errstate(invalid="ignore", divide="ignore"):
        w = np.where(np.isfinite(values), 1.0 / np.maximum(variances, 1e-300), 0.0)
        b = np.where(np.isfinite(values), values, 0.0)
        mean = (w * b).sum(axis=0) / w.sum(axis=0)
        count = np.isfinite(values).sum(axis=0)
        q = (w * (b - mean) ** 2).sum(axis=0) / (count - 1.0)
    free = np.maximum(count - 1.0, 1.0)
    return np.where(
        count >= FEWEST, stats.f.sf(q, free, np.maximum(EFFICIENCY * count, 1.0)), np.nan
    )


def _odd(kind, members, table, factor, found, by_others, least) -> dict[int, list[Cause]]:
    with np.errstate(invalid="ignore"):
        stands_out = np.flatnonzero((by_others.p < least).any(axis=1))
    if not len(stands_out):
        return {}
    likeness = shrunk(alike(table, found, factor))
    scale, out = np.sqrt(factor), {}
    freedom = np.maximum(found.count - 1.0, 1.0)
    for i in stands_out:
        own_root = table.roots[i] * scale[:, None]
        within = own_root @ own_root.T
        # the spread of the others, and how well their mean is known
        own = np.nan_to_num(by_others.std[i]) ** 2
        between = np.sqrt(np.maximum(own - np.diagonal(within), 1e-9 * own))
        covariance = within + np.outer(between, between) * likeness
        p_of = lambda z: 2.0 * stats.t.sf(np.abs(z), freedom)  # noqa: E731
        known = causes(
            kind.coordinates, by_others.deviation[i], covariance, by_others.std[i], p_of, least
        )
        if known:
            out[int(i)] = known
    return out
