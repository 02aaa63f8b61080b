"""Stamps that come in parts -> the stretches in which their clock is even, gaps aside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .rounded_stamps import UNIFORM
from .segment import GAP_STEPS


@dataclass(frozen=True)
class Stretch:
    """Rows of a file, evenly sampled: the first of them, how many, when they begin and how far they
    are apart [s]."""

    row: int
    rows: int
    begin: float
    step: float


class EvenClock:
    """Takes stamps in order. `even`: whether all steps so far are near the usual, the median of the
    first part's, or gaps; `longest`: the longest gap [s]."""

    def __init__(self) -> None:
        self.even, self.longest = True, 0.0
        self._step = 0.0
        self._done: list[tuple[int, float, int, float]] = []  # row and time of begin and end
        self._begin: tuple[int, float] | None = None
        self._last: tuple[int, float] | None = None

    @property
    def empty(self) -> bool:
        """Whether no stamp has come yet; the first part must have two."""
        return self._last is None

    def add(self, row: int, t: np.ndarray) -> None:
        """Take stamps (n,) [s] of the rows from `row` on."""
        if self._last is None:
            steps, later = np.diff(t), row + 1  # the row that the first step leads to
            self._begin, self._step = (row, float(t[0])), float(np.median(steps))
        else:
            steps, later = np.diff(t, prepend=self._last[1]), row
        gaps = steps > GAP_STEPS * self._step
        off = np.abs(steps[~gaps] - self._step)
        # written so that a stamp that is no number is not even
        self.even = self.even and bool(np.all(steps > 0.0) and np.all(off <= UNIFORM * self._step))
        for k in np.flatnonzero(gaps).tolist():
            at = later + k
            end = (at - 1, float(t[at - 1 - row])) if at > row else self._last
            self._done.append((*self._begin, *end))
            self._begin = (at, float(t[at - row]))
            self.longest = max(self.longest, float(steps[k]))
        self._last = (row + len(t) - 1, float(t[-1]))

    def stretches(self) -> list[Stretch]:
        """The stretches of two rows or more."""
        ends = [] if self._last is None else [*self._done, (*self._begin, *self._last)]
        return [
            Stretch(first, last - first + 1, begin, (end - begin) / (last - first))
            for first, begin, last, end in ends
            if last > first
        ]
