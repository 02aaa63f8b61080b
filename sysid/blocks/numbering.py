"""Which rows stand together: equal stretches of time within each piece, as long as what noise
remembers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

# s: several times the memory of the filters in use (0.05 to 0.1 s) and of a joint's friction loop
SHORTEST = 0.5
FEWEST, MOST = 12, 60  # below, no spread can be told; above, nothing is gained
# memories in a block: of a first-order noise, what stands across two is an eighth of its variance
_TIMES = 4.0


def divided(
    spans, *, memory: float = 0.0, shortest: float = SHORTEST, fewest: int = FEWEST
) -> list[int]:
    """Into how many blocks of equal length each piece is divided, by their spans.

    Args:
        memory: over which rows say the same thing, in the spans' unit. shortest: length of a block,
            unless fewer than `fewest` came of it in all.
    """
    total = sum(spans)
    length = min(max(total / MOST, shortest, _TIMES * memory), max(total / fewest, 1e-9))
    return [max(1, round(span / length)) for span in spans]


def numbered(
    t, piece, *, memory: float = 0.0, shortest: float = SHORTEST, fewest: int = FEWEST
) -> np.ndarray:
    """The block (n,) of each row: stretches of equal length within each piece, none across two
    pieces.

    Args:
        t: (n,) [s]. piece: (n,) number of the contiguous piece of each row.
        memory, shortest, fewest: as of `divided`, in seconds.
    """
    known = Numbering.of(extents(t, piece), memory=memory, shortest=shortest, fewest=fewest)
    return known.numbered(t, piece)


def extents(t, piece) -> dict[int, tuple[float, float]]:
    """{number: (first, last time [s])} of each contiguous piece (n,) among rows at t (n,)."""
    own = {int(number): t[piece == number] for number in np.unique(piece)}
    return {number: (float(at.min()), float(at.max())) for number, at in own.items()}


@dataclass(frozen=True)
class Numbering:
    """The blocks of rows that need not be at hand together: of each piece, the number of its first
    block, when it begins [s], how long it is, and how many blocks it has."""

    pieces: dict[int, tuple[int, float, float, int]]

    @staticmethod
    def of(extents: Mapping[int, tuple[float, float]], **how) -> Numbering:
        """Of pieces' extents, as `extents` tells them.

        Args:
            how: as of `divided`.
        """
        spans = [last - first for first, last in extents.values()]
        counts = divided(spans, **how)
        firsts = np.cumsum([0, *counts]).tolist()
        known = zip(extents.items(), firsts, spans, counts)
        return Numbering({k: (first, t, span, n) for (k, (t, _)), first, span, n in known})

    @property
    def size(self) -> int:
        """How many blocks there are."""
        return sum(count for *_, count in self.pieces.values())

    def numbered(self, t, piece) -> np.ndarray:
        """The block (n,) of some rows: t (n,) [s], and the piece (n,) that each is of."""
        out = np.zeros(len(t), dtype=int)
        for number in np.unique(piece).tolist():
            own, (first, begin, span, count) = piece == number, self.pieces[number]
            where = ((t[own] - begin) * (count / max(span, 1e-9))).astype(int)
            out[own] = first + np.minimum(where, count - 1)
        return out


def memory(values, use, piece, step: float) -> float:
    """Seconds over which values (n, k) at rows `step` seconds apart stay alike: the sum of their
    autocorrelation up to where it has gone, the longest of all columns.

    Args:
        use: (n, k) bool, rows that count. piece: (n,) number of the contiguous piece of each row.
    """
    n = len(values)
    kept = np.where(use, values, 0.0)
    lags = min(n // 4, int(2.0 / step))
    size = 1 << (2 * n).bit_length()
    number = np.unique(piece, return_inverse=True)[1]
    products, pairs = np.zeros((lags, values.shape[1])), np.zeros((lags, values.shape[1]))
    for k in range(number.max() + 1):
        own = number == k
        for out, x in ((products, kept[own]), (pairs, use[own].astype(float))):
            power = np.abs(np.fft.rfft(x, size, axis=0)) ** 2
            found = np.fft.irfft(power, axis=0)[: min(lags, own.sum())]
            out[: len(found)] += found
    alike = np.divide(products, pairs, out=np.zeros_like(products), where=pairs > 0.5)
    alike = alike / np.where(alike[:1] > 0, alike[:1], 1.0)
    gone = np.where((alike < 0.1).any(0), np.argmax(alike < 0.1, axis=0), lags)
    sums = [step * (0.5 + alike[1:last, j].sum()) for j, last in enumerate(gone) if use[:, j].any()]
    return float(max(sums, default=0.0))


def summed(blocks, values, size: int | None = None) -> np.ndarray:
    """Sums (blocks, ...) of values (n, ...) over rows whose block is `blocks` (n,), ascending or
    not."""
    values = np.asarray(values)
    size = int(blocks.max()) + 1 if size is None else size
    flat = values.reshape(len(values), -1)
    if not flat.shape[1]:
        return np.zeros((size, *values.shape[1:]))
    out = np.stack([np.bincount(blocks, v, minlength=size) for v in flat.T], 1)
    return out.reshape(size, *values.shape[1:])


def folds(count: int, most: int = 10) -> np.ndarray:
    """The fold (count,) of each block: neighbours together."""
    return np.arange(count) * min(most, count) // count


def by_block(number: np.ndarray) -> list[slice]:
    """The rows of each block, or log, of its number (n,): these stand in the order of the rows."""
    cuts = np.concatenate([[0], np.flatnonzero(np.diff(number)) + 1, [len(number)]])
    return [slice(a, b) for a, b in zip(cuts, cuts[1:])]
