"""The best step of few coordinates within many limits.

    max  slope' d - price s    with    slopes_k d <= room_k + s,    |d| <= radius,    s >= 0

Of the thousands of limits along a motion a solution touches some tens. So it is sought within few of them; where it
passes others, the peaks of what it passes join these, until it passes none. That is exact: what is
best within some of the limits and keeps to all is best within all. Neighbouring motions touch the same limits: a
program begins with those that the one before it touched.

Source: Kelley 1960 (cutting planes).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

_PASSED = 1e-9  # of a limit: more is beyond it
_TOUCHED = 1e-3  # of a limit: what is as near may hold the next step
_MANY = 1 << 40  # more than there are instants and pairs: by which limits are numbered


@dataclass(frozen=True)
class Limit:
    """slopes (n, k) of a step's coordinates, room (n,), in the order of time; number (n,): by which
    an instant is known again."""

    slopes: np.ndarray
    room: np.ndarray
    number: np.ndarray


@dataclass(frozen=True)
class Step:
    """The best step (k,), what it gains (slope' d - price s), and numbers of the limits it touches."""

    change: np.ndarray
    gain: float
    touched: np.ndarray


def both(share, slopes, number=None) -> Iterator[Limit]:
    """|share + slopes d| <= 1, of instants (n,) in the order of time."""
    number = np.arange(len(share)) if number is None else number
    for sign in (1.0, -1.0):
        yield Limit(sign * slopes, 1.0 - sign * share, number)


def best(slope, limits: Iterable[Limit], *, radius: float, price: float, first) -> Step | None:
    """The best step; None where it cannot be found.

    Args:
        slope (k,). limits: always in the same order, so that `first`, numbers of those to begin with,
            means the same.
    """
    kept = []
    for kind, limit in enumerate(limits):
        can = radius * np.abs(limit.slopes).sum(axis=1) > limit.room
        kept.append((limit.slopes[can], limit.room[can], kind * _MANY + limit.number[can]))
    rows, most, number = (np.concatenate(part) for part in zip(*kept))
    # one slack for all, so that there is a step from where a limit is passed, too
    matrix = np.column_stack([rows, -np.ones(len(rows))])
    cost = np.append(-np.asarray(slope), price)
    bounds = np.tile([-radius, radius], (len(cost), 1))
    bounds[-1] = 0.0, np.inf
    found, held = np.append(radius * np.sign(slope), 0.0), np.isin(number, first)
    more = held
    while True:
        if more.any():
            told = linprog(
                cost, A_ub=matrix[held], b_ub=most[held], bounds=bounds, method="highs",
                options={"presolve": False},
            )  # fmt: skip
            if told.status != 0:
                return None
            found = told.x
        over = matrix @ found - most
        more = _peaks(np.where(held, 0.0, over))
        if not more.any():
            return Step(found[:-1], float(-cost @ found), number[over > -_TOUCHED])
        held = held | more


def _peaks(over) -> np.ndarray:
    """(n,) bool: what is passed, by more than what stands beside it."""
    beside = np.concatenate([[-np.inf], over, [-np.inf]])
    return (over > _PASSED) & (over > beside[:-2]) & (over >= beside[2:])
