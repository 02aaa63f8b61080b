"""A range in which a value inside a formula is searched, with the values at which the search
begins."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

_PLACES, _DECADE, _PHASES, _SIDE = 25, 4, 8, 13  # how many are tried, in a range or a decade of it
CYCLES = 2000  # at most, of values that count cycles
SMALL = 1e-4  # of a signal: what is added to it and still matters, a hundredth that may be squared


@dataclass(frozen=True)
class Range:
    """Where a value is searched: from `low` to `high`, first at `tried`, ascending.

    least: what it may differ by and change little. spacing: "even"; "ratio", by equal ratios on
    either side of zero; "cycles", by `step`; "periods", whose inverse is by `step`.
    """

    low: float
    high: float
    spacing: str
    least: float
    step: float = 0.0
    tried: tuple[float, ...] = ()

    def within(self, low: float, high: float) -> Range:
        """The same kind of values within other bounds."""
        least = min(self.least, 0.1 * (high - low))
        if self.spacing == "even":
            tried = np.linspace(low, high, _PLACES)
        elif self.spacing == "cycles":
            tried = np.linspace(low, high, 2 + min(CYCLES, int((high - low) / self.step)))
        else:
            tried = self._sided(low, high, least)
        return replace(self, low=low, high=high, tried=tuple(tried.tolist()), least=least)

    def _sided(self, low: float, high: float, least: float) -> np.ndarray:
        out = []
        for sign, near, far in ((-1.0, -high, -low), (1.0, low, high)):
            near = max(near, least)
            if not far > near:
                continue
            if self.spacing == "periods":
                count = 2 + min(CYCLES, int((1.0 / near - 1.0 / far) / self.step))
                out.append(sign / np.linspace(1.0 / near, 1.0 / far, count))
            else:
                out.append(sign * np.geomspace(near, far, 2 + int(_DECADE * np.log10(far / near))))
        return np.unique(np.concatenate(out)) if out else np.linspace(low, high, 2)

    def respaced(self, low: float, high: float) -> np.ndarray:
        """Values to try between two bounds, ascending."""
        same = (low, high) == (self.low, self.high)
        return np.array(self.tried if same else self.within(low, high).tried)

    def united(self, other: Range) -> Range:
        """Of a value that stands in two places."""
        return replace(
            self, low=min(self.low, other.low), high=max(self.high, other.high),
            least=min(self.least, other.least), tried=tuple(sorted({*self.tried, *other.tried})),
        )  # fmt: skip

    def positive(self) -> Range:
        """Without its negative half."""
        own = tuple(at for at in self.tried if at > 0)
        return replace(self, low=min(own), tried=own)

    @property
    def typical(self) -> float:
        """The value in the middle of those tried; of a size of either sign a positive one."""
        own = [at for at in self.tried if at > 0 or self.spacing == "even"] or list(self.tried)
        return float(own[len(own) // 2])


def size(least: float, most: float) -> Range:
    """A size of either sign."""
    return Range(-most, most, "ratio", least).within(-most, most)


def count(least: float, most: float, step: float, exponent: int) -> Range:
    """How many cycles, of either sign, or the period of one where the exponent is -1."""
    if exponent > 0:
        half = Range(least, most, "cycles", step, step).within(least, most)
    else:
        least, most = 1.0 / most, 1.0 / least
        half = Range(least, most, "periods", least, step).within(least, most)
    tried = tuple(sorted({*half.tried, *(-at for at in half.tried)}))
    return replace(half, low=-most, tried=tried)


def place(signal: np.ndarray) -> Range:
    """A place on a signal."""
    low, high = float(signal.min()), float(signal.max())
    span = high - low
    return Range(low, high, "even", 0.01 * span).within(low - 0.5 * span, high + 0.5 * span)


def phase() -> Range:
    """A phase: tried once round, and free to go on as far again."""
    tried = tuple((-np.pi + 2.0 * np.pi * np.arange(_PHASES) / _PHASES).tolist())
    return Range(-2.0 * np.pi, 2.0 * np.pi, "even", 0.1, tried=tried)


def clear_of(signal: np.ndarray) -> Range:
    """Added to a signal without the sum's vanishing."""
    low, high = float(signal.min()), float(signal.max())
    most = max(-low, high) or 1.0
    whole = Range(0.0, 0.0, "ratio", SMALL * most)
    if low >= 0.0:
        return whole.within(SMALL * most, 10.0 * most)
    if high <= 0.0:
        return whole.within(-10.0 * most, -SMALL * most)
    span = high - low
    away = span * np.geomspace(0.01, 10.0, _SIDE)
    tried = np.sort(np.concatenate([-low + away, -high - away]))
    return Range(tried[0], tried[-1], "even", 0.01 * span, tried=tuple(tried.tolist()))
