"""Rows of a log as they were measured, in parts; and of those at which something is so, how many
there are, when the first of them are, and where it is most so.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

SHOWN = 8  # times


@dataclass(frozen=True)
class Samples:
    """Samples as they were measured: stamps t (n,) [s], angles q and torque tau (n, dof)."""

    t: np.ndarray
    q: np.ndarray
    tau: np.ndarray


@dataclass(frozen=True)
class Told:
    """Rows at which something is so: how many, when [s] the first few are; and of the one at which
    it is most so the size of it, the time [s] and the value there."""

    count: int = 0
    times: tuple[float, ...] = ()
    most: float = -np.inf
    at: float = np.nan
    value: float = np.nan

    def then(self, later: Told) -> Told:
        """With what a later part tells."""
        worst = later if later.most > self.most else self
        times = (*self.times, *later.times)[:SHOWN]
        return Told(self.count + later.count, times, worst.most, worst.at, worst.value)


def told(flags, size, t, value=None) -> Told:
    """Of the rows (n,) that are flagged.

    Args:
        size: (n,) how much so it is. t: (n,) [s]. value: (n,) what is told of the greatest; None:
            its size.
    """
    (rows,) = np.nonzero(flags)
    if not len(rows):
        return Told()
    worst = rows[int(np.argmax(size[rows]))]
    own = (size if value is None else value)[worst]
    times = tuple(float(at) for at in t[rows[:SHOWN]])
    return Told(len(rows), times, float(size[worst]), float(t[worst]), float(own))


def behind(parts: Iterable[Samples], rows: int) -> Iterator[tuple[Samples, int]]:
    """Each part behind the last rows of what stands before it, and how many these are."""
    tail: Samples | None = None
    for part in parts:
        seen = 0 if tail is None else len(tail.t)
        if tail is not None:
            pairs = ((tail.t, part.t), (tail.q, part.q), (tail.tau, part.tau))
            part = Samples(*(np.concatenate(pair) for pair in pairs))
        yield part, seen
        tail = Samples(*(own[-rows:].copy() for own in (part.t, part.q, part.tau)))
