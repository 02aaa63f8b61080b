"""Single columns on one joint, thousands of them, each asked alone: which one stands out most, and
how far the one would that stands out most of noise.

The statistic is that of every group (`diagnose.evidence`), a column's coefficient over what its
blocks tell of how far it moves. Of thousands one meets blocks that happen to tell little, and slow
noise that stands across two of them. So the null is noise of the spectrum that the fit left: drawn,
fitted by the same model, and asked by the same columns, it has both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from scipy.special import log_ndtr, ndtri

from .. import blocks
from ..projection import DATA, FLAT, NOISE
from .stationary import drawn

Columns = Callable[[], Iterable[tuple[list[str], np.ndarray]]]

_DRAWS = 200  # of noise: quartiles of a maximum are known to a tenth of its deviation
_LEAST = 50  # of a long log; and of any at first, which say where there is no need of more
_CLEAR = 0.05  # a chance that no more draws would bring below a thousandth
_MOST = 2e6  # draws times rows, up to where fewer draws are made


@dataclass(frozen=True)
class Single:
    """The column that stands out most, on all rows that were asked, its words, the probability of a
    statistic as great among all of them, were nothing there, and the share that it takes of the
    squared residual of blocks that it was not fitted on."""

    words: str
    column: np.ndarray
    chance: float
    share: float


def greatest(views, j: int, asked: Columns, seed: int) -> Single | None:
    """Of the columns (n, k) of joint j that `asked()` brings, with words of each, some at a time;
    None where the first view can ask none.

    The probability goes on beyond the draws, of which few are made where they leave no doubt that
    nothing is there (Besag & Clifford 1991).

    Args:
        views: one, or one and the same model settled on other logs. The rows of columns are theirs,
            one view's after the other's, behind each those of its rough motion.
    """
    most, found = min(_draws(view) for view in views), None
    for draws in (_LEAST, most) if most > _LEAST else (most,):
        found = _greatest(views, j, asked, np.random.default_rng(seed), draws)
        if found is None or found.chance > _CLEAR:
            break
    return found


def _greatest(views, j: int, asked: Columns, rng, draws: int) -> Single | None:
    askers = [_Asker(view, j, rng, draws) for view in views]
    ends = np.cumsum([len(asker.residual) for asker in askers for _ in range(2)])[:-1]
    found: list[list[_Told]] = [[] for _ in views]
    places = []
    for part, (_, values) in enumerate(asked()):
        places += [(part, k) for k in range(values.shape[1])]
        for view, asker, own, told in zip(views, askers, _parted(values, ends), found):
            told.append(asker.told_by(*(view.weights[j] * one for one in own)))
    scores, information = np.zeros((1 + draws, len(places))), np.zeros(len(places))
    here = np.zeros(0, dtype=int)
    for number, (asker, told) in enumerate(zip(askers, found)):
        starts = np.cumsum([0, *(one.count for one in told)])
        kept = np.concatenate([np.zeros(0, int), *(s + one.kept for s, one in zip(starts, told))])
        here = here if number else kept
        if len(kept):
            scores[:, kept] += np.sqrt(own := _joined(told, "unit")) * asker.scores(told)
            information[kept] += own
    if not len(here):
        return None
    scores = _outlying(np.abs(scores[:, here] / np.sqrt(information[here])))
    best = int(np.argmax(scores[0]))
    part, k = places[here[best]]
    # made again, not kept: those of a long log fill the memory
    words, values = next(islice(asked(), part, None))
    column, chance = values[:, k].copy(), beyond(scores[0, best], scores[1:].max(axis=1))
    parts = zip(views, askers, _parted(column[:, None], ends))
    told = [asker.apart(*(view.weights[j] * one for one in own)) for view, asker, own in parts]
    share = _share(told)
    return Single(words[k], column, chance, share / max(sum(a.loss[0] for a in askers), 1e-300))


def _parted(values, ends) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Of each view its rows of columns, and what the angles' noise, once more, adds to them."""
    parts = iter(np.split(values, ends))
    return ((plain, rough - plain) for plain, rough in zip(parts, parts))


def _share(told) -> float:
    """What a column takes of the squared residual of its joint's own rows, in blocks that it was
    not fitted on: to the bodies that it lets go, other joints may owe as much. By the scores and
    squares (blocks + 1,) of each view, and the same of the joint's own rows; the prior's last."""
    score, squares, *own = (
        np.concatenate([*(v[:-1] for v in s), [sum(v[-1] for v in s)]]) for s in zip(*told)
    )
    unit = squares.sum()
    parts = [
        (a[:, None] / np.sqrt(unit), b[:, None, None] / unit) for a, b in ((score, squares), own)
    ]
    c = np.array([score.sum() / np.sqrt(unit)])
    return max(float(blocks.gains(c, *parts[0], own=parts[1]).sum()), 0.0)


def _outlying(size):
    """The normal score of a size: how far out on one side it stands as often as on either."""
    return -ndtri(np.exp(np.maximum(np.log(2.0) + log_ndtr(-size), -700.0)))


def _sized(score):
    """The size of a normal variable that stands as far out on either side as a score on one."""
    return -ndtri(0.5 * np.exp(np.maximum(log_ndtr(-score), -700.0)))


def beyond(value: float, maxima: np.ndarray) -> float:
    """Probability that the greatest of many is more than a value, by maxima (draws,) of noise: that
    of as many independent normal variables of such a size as have the quartiles of these."""
    low, middle, high = np.quantile(maxima, [0.25, 0.5, 0.75])
    # the more there are, the narrower their greatest beside how far out it is
    count = np.geomspace(1.0, 1e6, 200)
    log = np.log([0.25, 0.5, 0.75])[:, None]
    least, half, most = -ndtri(-np.expm1(log / count))
    k = int(np.argmin(np.abs(half / (most - least) - middle / max(high - low, 1e-12))))
    size = max(high - low + middle, 1e-12) / (most - least + half)[k]
    return float(-np.expm1(count[k] * log_ndtr(value / size)))


@dataclass(frozen=True)
class _Told:
    """Of so many columns, those `kept` (k,) that rest on enough: of unit size, which `unit` (k,) is
    the square of, their coefficients c and the squared deviations `seen` (1 + draws, k) that blocks
    tell, with `own` (k,) degrees of freedom.
    """

    count: int
    kept: np.ndarray
    unit: np.ndarray
    c: np.ndarray
    seen: np.ndarray
    own: np.ndarray


def _joined(told: list[_Told], name: str) -> np.ndarray:
    return np.concatenate([getattr(one, name) for one in told], axis=-1)


def _draws(view) -> int:
    return int(np.clip(_MOST / len(view.design.residual), _LEAST, _DRAWS))


def _resting(squares: np.ndarray, size: np.ndarray):
    """On how many blocks columns (k,) rest, of squares (blocks + 1, k) with the prior's last, and
    the greatest share of one block; none where `size` (k,) is infinite."""
    share = squares[:-1] / size
    whole = np.where(np.isfinite(size), share.sum(axis=0), 0.0)
    square = np.where(whole > 0.0, np.sum(share**2, axis=0), 1.0)
    return whole**2 / square, share.max(axis=0) / np.where(whole > 0.0, whole, 1.0)


def noises(view, j: int, rng: np.random.Generator, draws: int, spans: Sequence[slice]):
    """Noise (n, draws) of the spectrum that a view's model left of joint j, once the same model is
    fitted to such noise of all joints; and what the model's columns said of it over spans of rows
    (spans, p, draws)."""
    design = view.design
    told = np.zeros((len(spans), design.columns.shape[2], draws))
    for k, columns in enumerate(design.columns):
        noise = drawn(view.spectra[k], len(columns), draws, rng) * view.rows.use[:, [k]]
        for b, rows in enumerate(spans):
            told[b] += columns[rows].T @ noise[rows]
        if k == j:
            own = noise
    return own - design.columns[j] @ told.sum(0), told


class _Asker:
    """The residual of joint j, and draws of noise that the same model was fitted to, both with what
    each block tells of the model's own parameters."""

    def __init__(self, view, j: int, rng: np.random.Generator, draws: int):
        design, sums, self.spans = view.design, view.sums, blocks.by_block(view.blocks)
        fitted, told = noises(view, j, rng, draws, self.spans)
        told = told - sums.squares[:-1] @ told.sum(0)
        told = np.concatenate([told, -told.sum(0, keepdims=True)])
        self.columns, self.squares, self.freed = design.columns[j], sums.squares, sums.freed
        self.rough_columns, self.rough_squares = design.rough_columns[j], sums.rough_squares
        self.noise = design.rough_residual[:, j]
        self.residual, self.drawn = design.residual[:, j], fitted.astype(np.float32)
        self.loss = np.append(np.sum(self.residual**2), np.sum(fitted**2, axis=0))
        self.told = sums.scores - sums.rough_scores
        self.told_of_drawn = np.swapaxes(told, 1, 2).astype(np.float32)

    def _summed(self, values: np.ndarray, more: np.ndarray):
        """Over blocks, the prior's last, of weighted columns (n, k): squares of them, and off the
        model; scores off the model; what the model takes of them, of all and mixed with its own;
        and the squares of what the angles' noise adds to what is left of them."""
        parts, count = len(self.told), values.shape[1]
        cross = np.zeros((parts, self.columns.shape[1], count))
        own, score = np.zeros((parts, count)), np.zeros((parts, count))
        for b, rows in enumerate(self.spans):
            cross[b] = self.columns[rows].T @ values[rows]
            own[b] = np.einsum("nk,nk->k", values[rows], values[rows])
            score[b] = self.residual[rows] @ values[rows] - self.noise[rows] @ more[rows]
        absorbed = cross.sum(0)  # in the design's directions, in which the system is one
        score -= self.told @ absorbed
        mixed = cross - self.squares @ absorbed
        squares = own - np.einsum("bpk,pk->bk", cross + mixed, absorbed)
        noise, taken = self.rough_squares @ absorbed, np.einsum("nk,nk->k", more, more)
        rough = 2.0 * (taken + np.sum(absorbed * noise, axis=0))  # at most
        some = rough >= NOISE * squares.sum(0)
        noise = 2.0 * (self.rough_columns.T @ more[:, some]) - noise[:, some]
        rough[some] = taken[some] - np.sum(absorbed[:, some] * noise, axis=0)
        return own, squares, score, absorbed, mixed, rough

    def apart(self, column: np.ndarray, more: np.ndarray) -> tuple[np.ndarray, ...]:
        """Scores and squares (blocks + 1,) of one weighted column (n, 1), off the model, and the
        same on the joint's own rows."""
        _, squares, score, absorbed, *_ = self._summed(column, more)
        off = (column - self.columns @ absorbed)[:, 0]
        noisy = (more - self.rough_columns @ absorbed)[:, 0]
        starts = [rows.start for rows in self.spans]
        own = (self.residual * off - self.noise * noisy, off**2)
        own = (np.append(np.add.reduceat(values, starts), 0.0) for values in own)
        return score[:, 0], squares[:, 0], *own

    def told_by(self, values: np.ndarray, more: np.ndarray) -> _Told:
        """Of weighted columns (n, k), with what the angles' noise, once more, adds to them."""
        own, squares, score, absorbed, mixed, rough = self._summed(values, more)
        whole, data = squares.sum(0), squares[:-1].sum(0)
        known = (whole > FLAT * own.sum(0)) & (data > DATA * whole)
        known &= rough < NOISE * whole
        weight = np.ones_like(squares)
        rest, most = _resting(squares, np.where(known, data, np.inf))
        for k in np.flatnonzero(known & ((rest < blocks.RESTING) | (most > blocks.LEVERAGE))):
            # no block counts more than the rest allows: a choice that looks at the column alone
            weight[:-1, k] = blocks.evening(squares[:-1, k] / data[k])
        rest, most = _resting(weight * squares, np.where(known, data, np.inf))
        good = known & (rest >= blocks.RESTING) & (most <= blocks.LEVERAGE)
        absorbed, mixed, squares = absorbed[:, good], mixed[:, :, good], squares[:, good]
        freed = self.freed @ mixed  # what the model's own columns took of a block's noise
        count, weight = weight.shape[1], weight[:, good]
        unit = np.sum(weight * squares, axis=0)
        others = weight / np.maximum(unit - weight * squares, 1e-12 * unit)
        loud_squares = squares + np.einsum("bpk,bpk->bk", mixed, freed)

        def told(score, moves):
            c = np.einsum("bg,bdg->dg", weight, score) / unit
            moves -= loud_squares[:, None] * c
            moves *= others[:, None]
            # of a column of unit size
            return np.sqrt(unit) * c, unit * np.einsum("bdk,bdk->dk", moves, moves)

        score = score[:, None, good]
        real = told(score, score + np.einsum("bp,bpk->bk", self.told, freed)[:, None])
        # of draws these are the greatest arrays of a diagnosis: in single precision, and in place
        back, single = self.told_of_drawn, values[:, good].astype(np.float32)
        score = back @ -absorbed.astype(np.float32)
        for b, rows in enumerate(self.spans):
            score[b] += self.drawn[rows].T @ single[rows]
        moves = back @ freed.astype(np.float32)
        moves += score
        c, seen = (np.concatenate(both) for both in zip(real, told(score, moves)))
        freedom = np.maximum(rest[good] - 1.0, 1.0)
        return _Told(count, np.flatnonzero(good), unit, c, seen, freedom)

    def scores(self, told: list[_Told]) -> np.ndarray:
        """(1 + draws, k) of all columns that are kept, as normal variables with the sign of the
        coefficient."""
        c, seen, own = (_joined(told, name) for name in ("c", "seen", "own"))
        # noise as always, less what the column takes of it
        left = 1.0 - np.minimum(c**2 / np.maximum(self.loss[:, None], 1e-300), blocks.LEVERAGE)
        foreseen = np.mean(c[1:] ** 2, axis=0) * left
        belief = blocks.believed(seen[0], foreseen[0], own, len(self.squares))
        spread, rest = belief.moderated(seen, foreseen, own)
        far = blocks.normal_scores(c**2 / np.maximum(spread, 1e-300), 1.0, rest)
        return np.sign(c) * _sized(far)
