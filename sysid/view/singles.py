"""Single columns on one joint, thousands of them, each asked alone: which one stands out most, and
how far the one would that stands out most of noise.

The statistic is that of every group (`diagnose.evidence`), a column's coefficient over what its
blocks tell of how far it moves. Of thousands one meets blocks that happen to tell little, and slow
noise that stands across two of them. So the null is noise of the spectrum that the fit left: drawn,
fitted by the same model, and asked by the same columns, it has both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import islice
from operator import attrgetter

import numpy as np
from scipy.special import ndtr, ndtri

from .. import blocks
from ..projection import DATA, FLAT
from .design import by_block
from .stationary import drawn

Columns = Callable[[], Iterable[tuple[list[str], np.ndarray]]]

_DRAWS = 200  # of noise: quartiles of a maximum are known to a tenth of its deviation
_LEAST = 50  # of a long log
_MOST = 2e6  # draws times rows, up to where fewer draws are made


@dataclass(frozen=True)
class Single:
    """The column (n,) that stands out most, its words, and the probability of a statistic as great
    among all of them, were nothing there."""

    words: str
    column: np.ndarray
    chance: float


def greatest(view, j: int, asked: Columns, rng: np.random.Generator) -> Single | None:
    """Of the columns (n, k) of joint j that `asked()` brings, with words of each, some at a time;
    None where none can be asked.

    The probability goes on beyond the draws.
    """
    asker = _Asker(view, j, rng)
    found = [asker.told_by(view.weights[j] * values) for _, values in asked()]
    places = [(part, k) for part, one in enumerate(found) for k in one.kept]
    if not places:
        return None
    joined = lambda pick: np.concatenate([pick(one) for one in found], axis=-1)  # noqa: E731
    c, seen, own = (joined(attrgetter(name)) for name in ("c", "seen", "own"))
    # noise as always, less what the column takes of it
    left = 1.0 - np.minimum(c**2 / np.maximum(asker.loss[:, None], 1e-300), blocks.LEVERAGE)
    foreseen = np.mean(c[1:] ** 2, axis=0) * left
    belief = blocks.believed(seen[0], foreseen[0], own, len(view.sums.scores))
    spread, rest = belief.moderated(seen, foreseen, own)
    scores = blocks.normal_scores(c**2 / np.maximum(spread, 1e-300), 1.0, rest)
    best = int(np.argmax(scores[0]))
    part, k = places[best]
    # made again, not kept: those of a long log fill the memory
    words, values = next(islice(asked(), part, None))
    chance = _beyond(scores[0, best], scores[1:].max(axis=1))
    return Single(words[k], np.ascontiguousarray(values[:, k]), chance)


def _beyond(value: float, maxima: np.ndarray) -> float:
    """Probability that the greatest of many is more than a value, by maxima (draws,) of noise: that
    of as many independent normal variables of such a size as have the quartiles of these."""
    low, middle, high = np.quantile(maxima, [0.25, 0.5, 0.75])
    # the more there are, the narrower their greatest beside how far out it is
    count = np.geomspace(1.0, 1e6, 200)
    log = np.log([0.25, 0.5, 0.75])[:, None]
    least, half, most = -ndtri(-np.expm1(log / count))
    k = int(np.argmin(np.abs(half / (most - least) - middle / max(high - low, 1e-12))))
    size = max(high - low + middle, 1e-12) / (most - least + half)[k]
    return float(-np.expm1(count[k] * np.log1p(-ndtr(-value / size))))


@dataclass(frozen=True)
class _Told:
    """Of columns of unit size, those `kept` (k,) that rest on enough: their coefficients c and the
    squared deviations `seen` (1 + draws, k) that blocks tell, with `own` (k,) degrees of freedom.
    """

    kept: np.ndarray
    c: np.ndarray
    seen: np.ndarray
    own: np.ndarray


def _resting(squares: np.ndarray, size: np.ndarray):
    """On how many blocks columns (k,) rest, of squares (blocks + 1, k) with the prior's last, and
    the greatest share of one block; none where `size` (k,) is infinite."""
    share = squares[:-1] / size
    whole = np.where(np.isfinite(size), share.sum(axis=0), 0.0)
    square = np.where(whole > 0.0, np.sum(share**2, axis=0), 1.0)
    return whole**2 / square, share.max(axis=0) / np.where(whole > 0.0, whole, 1.0)


class _Asker:
    """The residual of joint j, and draws of noise that the same model was fitted to, both with what
    each block tells of the model's own parameters."""

    def __init__(self, view, j: int, rng: np.random.Generator):
        design, sums, self.spans = view.design, view.sums, by_block(view.blocks)
        size = len(design.residual)
        draws = int(np.clip(_MOST / size, _LEAST, _DRAWS))
        told = np.zeros((len(self.spans), design.columns.shape[2], draws))
        for k, columns in enumerate(design.columns):
            noise = drawn(view.spectra[k], size, draws, rng) * view.rows.use[:, [k]]
            for b, rows in enumerate(self.spans):
                told[b] += columns[rows].T @ noise[rows]
            if k == j:
                own = noise
        change = told.sum(0)
        fitted = own - design.columns[j] @ change
        told = told - sums.squares[:-1] @ change
        told = np.concatenate([told, -told.sum(0, keepdims=True)])
        self.columns, self.squares, self.freed = design.columns[j], sums.squares, sums.freed
        self.rows = np.column_stack([design.residual[:, j], fitted])
        self.loss = np.sum(self.rows**2, axis=0)
        first = (sums.scores - sums.rough_scores)[:, :, None]
        self.told = np.concatenate([first, told], axis=2)

    def told_by(self, values: np.ndarray) -> _Told:
        """Of weighted columns (n, k)."""
        parts, count = len(self.told), values.shape[1]
        cross = np.zeros((parts, self.columns.shape[1], count))
        own, score = np.zeros((parts, count)), np.zeros((parts, self.rows.shape[1], count))
        for b, rows in enumerate(self.spans):
            cross[b] = self.columns[rows].T @ values[rows]
            own[b] = np.sum(values[rows] ** 2, axis=0)
            score[b] = self.rows[rows].T @ values[rows]
        absorbed = cross.sum(0)  # in the design's directions, in which the system is one
        mixed = cross - self.squares @ absorbed
        squares = own - np.einsum("bpk,pk->bk", cross + mixed, absorbed)
        whole, data = squares.sum(0), squares[:-1].sum(0)
        known = (whole > FLAT * own.sum(0)) & (data > DATA * whole)
        weight = np.ones_like(squares)
        rest, most = _resting(squares, np.where(known, data, np.inf))
        for k in np.flatnonzero(known & ((rest < blocks.RESTING) | (most > blocks.LEVERAGE))):
            # no block counts more than the rest allows: a choice that looks at the column alone
            weight[:-1, k] = blocks.evening(squares[:-1, k] / data[k])
        rest, most = _resting(weight * squares, np.where(known, data, np.inf))
        good = known & (rest >= blocks.RESTING) & (most <= blocks.LEVERAGE)
        absorbed, mixed, squares = absorbed[:, good], mixed[:, :, good], squares[:, good]
        freed = self.freed @ mixed  # what the model's own columns took of a block's noise
        back = np.swapaxes(self.told, 1, 2)
        score = score[:, :, good] - back @ absorbed
        loud = score + back @ freed
        loud_squares = squares + np.einsum("bpk,bpk->bk", mixed, freed)
        weight = weight[:, good]
        unit = np.sum(weight * squares, axis=0)
        c = np.einsum("bg,bdg->dg", weight, score) / unit
        moves = loud - loud_squares[:, None] * c
        moves *= (weight / (unit - weight * squares))[:, None]
        # of a column of unit size
        seen, root = unit * np.sum(moves**2, axis=0), np.sqrt(unit)
        return _Told(np.flatnonzero(good), root * c, seen, np.maximum(rest[good] - 1.0, 1.0))
