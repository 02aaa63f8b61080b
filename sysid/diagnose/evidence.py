"""One statistic for every candidate, as sums over blocks of time.

A group is the columns of one candidate at one set of shape values, projected off everything in the
model and made orthonormal. Over blocks b:

    s_b = Q_b' r_b - (what the angles' noise makes of it),   G_b = Q_b' Q_b
    c = sum_b s_b + s_0                       its coefficients; s_0 is the prior's, a block that is
    never left out m_b = (1 - G_b)^-1 (s_b - G_b c)          how far they move when a block is left
    out T = c'c / sum_b |m_b|^2                   is it there? gain = sum_f 2 c_f' s_f - c_f' G_f
    c_f    what does it take of blocks that it was not fitted on? c_f = (1 - G_f)^-1 (c - s_f)

T is told on the scale of a normal variable, with as many degrees of freedom as blocks and
directions take part: then groups that rest on few blocks and groups that rest on many can stand in
one row.

The noise of the angles stands in residual and columns alike, which neither signs nor folds can see.
It is drawn once more: what the second draw adds to columns times what it adds to the residual has
the mean of what the first one left in s_b, and is taken off (simulation extrapolation: Cook &
Stefanski 1994).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .. import blocks
from ..candidates import Candidate, columns_of, tried
from ..view import View, by_block

_FLAT = 1e-6  # share of a column's square: what the model leaves of it beyond that is rounding
_DATA = 0.5  # of a direction's square must stand in the data; the prior may not tell most of it
_NOISE = 0.25  # of a direction's square: a column that is noise to half of its size says nothing about a law
_FEWEST = 5.0  # blocks that a test must rest on; and a block may not hold more of a direction than all but a tenth
_LEVERAGE = 0.9
_BATCH = 256  # columns' sets that stand in memory at once


@dataclass(frozen=True)
class Group:
    """One candidate at shape values. scores (blocks, k), squares (blocks, k, k) of the orthonormal
    columns, `kept` (k,) the prior's score; `back` (k0, k) turns coefficients of these into the
    candidate's own; `sizes` (k0,) the weighted norm of what the model leaves of each own column."""

    candidate: Candidate
    shapes: dict[str, float]
    scores: np.ndarray
    squares: np.ndarray
    kept: np.ndarray
    back: np.ndarray
    sizes: np.ndarray

    @property
    def c(self) -> np.ndarray:
        """(k,) coefficients of the orthonormal columns."""
        return self.scores.sum(0) + self.kept

    @property
    def moves(self) -> np.ndarray:
        """(blocks, k) how far they move when a block is left out."""
        return np.einsum("bkl,bl->bk", left_out(self.squares), self.scores - self.squares @ self.c)

    @property
    def freedom(self) -> tuple[float, float]:
        """Degrees of freedom: directions that take part (Satterthwaite 1946), and blocks that they
        rest on."""
        moves = self.moves
        spread = moves.T @ moves
        directions = np.trace(spread) ** 2 / max(np.sum(spread**2), 1e-300)
        return float(directions), resting(self.squares)

    @property
    def testable(self) -> bool:
        """Whether it rests on enough blocks to be told from chance; if not, it may still be a rival
        of one that is."""
        return (
            resting(self.squares) >= _FEWEST
            and float(np.linalg.eigvalsh(self.squares).max()) <= _LEVERAGE
        )

    @cached_property
    def tested(self) -> Group:
        """The group by which it is told whether it is there: of an effect that comes in blows, a
        few of which outweigh all others, one in which no block counts more than the rest allows.

        Weights that look at columns alone leave scores of noise as they are, without a sign; blows
        are as good as orthogonal to the model, in each block. What it takes, and its coefficients,
        are the group's own.
        """
        if not self.candidate.blows:
            return self
        share = np.einsum("bkk->b", self.squares)
        weight = np.minimum(1.0, _most(share) / np.maximum(share, 1e-300))
        if weight.min() == 1.0:
            return self
        squares = self.squares * weight[:, None, None]
        values, vectors = np.linalg.eigh(squares.sum(0))
        turn = vectors / np.sqrt(np.maximum(values, 1e-300))
        sizes = self.sizes * float(np.sqrt(values.min()))
        scores = weight[:, None] * self.scores @ turn
        return replace(
            self,
            scores=scores,
            squares=turn.T @ squares @ turn,
            kept=self.kept @ turn,
            back=self.back @ turn,
            sizes=sizes,
        )

    @property
    def numbers(self) -> int:
        """How many numbers it fits: its directions, and shape values that were searched."""
        return len(self.c) + (0 if self.candidate.nonlinear else len(self.shapes))

    @property
    def coefficients(self) -> np.ndarray:
        """(k0,) the candidate's own."""
        return self.back @ self.c


Asked = tuple[Candidate, dict[str, float]]  # a candidate at shape values


def groups(view: View, candidates: Sequence[Candidate]) -> list[Group]:
    """The groups of candidates, one for each set of shape values tried; none of those that the
    model absorbs."""
    return groups_at(
        view, [(candidate, shapes) for candidate in candidates for shapes in tried(view, candidate)]
    )


def groups_at(view: View, asked: Sequence[Asked]) -> list[Group]:
    """The groups of candidates at shape values; those on the same joints with as many columns are
    made together."""
    dof, alike = view.model.robot.dof, {}
    for candidate, own in _together(asked):
        plain, rough = (
            columns_of(source, candidate, own) for source in (view.source, view.rough_source)
        )
        key = (tuple(candidate.touches(dof)), plain.shape[3])
        alike.setdefault(key, []).append(([(candidate, shapes) for shapes in own], plain, rough))
    out = []
    for (joints, _), parts in alike.items():
        names = [one for part in parts for one in part[0]]
        plain, rough = (np.concatenate([part[i] for part in parts]) for i in (1, 2))
        for some in range(0, len(names), _BATCH):
            own = slice(some, some + _BATCH)
            out += _made(view, names[own], joints, plain[own], rough[own])
    return out


def _together(asked: Sequence[Asked]) -> list[tuple[Candidate, list[dict]]]:
    out: list[tuple[Candidate, list[dict]]] = []
    for candidate, shapes in asked:
        if not out or out[-1][0] is not candidate:
            out.append((candidate, []))
        out[-1][1].append(shapes)
    return out


def _made(
    view: View, asked: Sequence[Asked], joints: Sequence[int], plain: np.ndarray, rough: np.ndarray
) -> list[Group]:
    """Groups of columns (asked, joints, n, k) on the motion, and on the rough one."""
    design, sums, spans = view.design, view.sums, by_block(view.blocks)
    count, _, n, k = plain.shape
    flat = lambda a, i, j: np.moveaxis(a[:, i], 1, 0).reshape(n, count * k) * view.weights[j]  # noqa: E731
    size, kk = design.columns.shape[2], count * k
    cross, own = np.zeros((len(spans), size, kk)), np.zeros((len(spans), count, k, k))
    score, rough_cross, rough_own = (
        np.zeros((len(spans), kk)),
        np.zeros((size, kk)),
        np.zeros((count, k, k)),
    )
    square = lambda a: np.einsum("nsk,nsl->skl", a, a)  # noqa: E731
    for i, j in enumerate(joints):
        values = flat(plain, i, j)
        more = flat(rough, i, j) - values
        noise = more * design.rough_residual[:, j, None]
        rough_cross += design.rough_columns[j].T @ more
        rough_own += square(more.reshape(n, count, k))
        for b, rows in enumerate(spans):
            cross[b] += design.columns[j][rows].T @ values[rows]
            score[b] += design.residual[rows, j] @ values[rows] - noise[rows].sum(0)
            own[b] += square(values[rows].reshape(-1, count, k))
    total = cross.sum(0)
    absorbed = design.inverse @ total
    score = (score - (sums.scores - sums.rough_scores) @ absorbed).reshape(len(spans), count, k)
    prior = (sums.scores.sum(0) @ absorbed).reshape(count, k)
    by = absorbed.reshape(size, count, k)
    reduced = lambda own, cross, squares: _reduced(own, cross, squares, absorbed, by)  # noqa: E731
    squares = np.stack([reduced(own[b], cross[b], sums.squares[b]) for b in range(len(spans))])
    rough_square = reduced(rough_own, rough_cross, sums.rough_squares)
    whole = own.sum(0) - np.einsum("psk,psl->skl", by, total.reshape(size, count, k))
    out = []
    for s in range(count):
        found = _turned(own[:, s].sum(0), whole[s], squares[:, s], rough_square[s])
        if found is None:
            continue
        turn, turned, sizes = found
        out.append(
            Group(
                asked[s][0],
                dict(asked[s][1]),
                score[:, s] @ turn,
                turned,
                prior[s] @ turn,
                turn,
                sizes,
            )
        )
    return out


def _reduced(own, cross, squares, absorbed, by) -> np.ndarray:
    """(shapes, k, k) squares of columns less what the model absorbs of them."""
    size, count, k = by.shape
    mixed = np.einsum("psk,psl->skl", by, cross.reshape(size, count, k))
    inner = np.einsum("psk,psl->skl", by, (squares @ absorbed).reshape(size, count, k))
    return own - mixed - np.swapaxes(mixed, -1, -2) + inner


def _turned(plain, whole, squares, rough):
    """Orthonormal directions (k0, k) that the model leaves, that the data tell and that are no
    noise, the squares (blocks, k, k) in them, and the norm of what is left of each own column; None
    where there is none."""
    size = np.sqrt(np.clip(np.diagonal(plain), 0.0, None))
    if not np.all(np.isfinite(whole)) or not size.max() > 0:
        return None
    scale = np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(whole / np.outer(scale, scale))
    kept = values > _FLAT
    turn = vectors[:, kept] / np.sqrt(values[kept]) / scale[:, None]
    for matrix, good in ((squares.sum(0), lambda v: v > _DATA), (rough, lambda v: v < _NOISE)):
        values, vectors = np.linalg.eigh(turn.T @ matrix @ turn)
        turn = turn @ vectors[:, good(values)]
        if not turn.shape[1]:
            return None
    turned = np.einsum("ki,bkl,lj->bij", turn, squares, turn, optimize=True)
    return turn, turned, np.sqrt(np.clip(np.diagonal(whole), 0.0, None))


def resting(squares: np.ndarray) -> float:
    """On how many blocks a group rests: the inverse of the sum of squared shares (blocks, k, k)."""
    share = np.einsum("bkk->b", squares)
    return float(share.sum() ** 2 / max(np.sum(share**2), 1e-300))


def _most(share: np.ndarray) -> float:
    """What no block's share (blocks,) may pass for no block to hold more than an even part of twice
    the fewest blocks."""
    ascending = np.sort(share)
    below = np.concatenate([[0.0], np.cumsum(ascending)])
    count = len(share) - np.arange(len(share))
    capped = below[:-1] + count * ascending  # of all, where each in turn is the most
    fits = ascending <= capped / (2.0 * _FEWEST)
    if fits.all():
        return float(ascending[-1])
    k = int(np.argmin(fits))  # the first that is too much: between its neighbour below and it
    rest = 2.0 * _FEWEST - count[k]
    return float(below[k] / rest) if rest > 0 else float(ascending[k])


def left_out(squares: np.ndarray) -> np.ndarray:
    """(1 - G_b)^-1 (..., k, k)."""
    return np.linalg.inv(np.eye(squares.shape[-1]) - squares)


def gain(group: Group) -> np.ndarray:
    """(folds,) what a group takes of the weighted squared residual of blocks that it was not fitted
    on."""
    fold = blocks.folds(len(group.scores))
    s, g = blocks.summed(fold, group.scores), blocks.summed(fold, group.squares)
    rest = np.linalg.solve((1.0 + 1e-9) * np.eye(s.shape[1]) - g, (group.c - s)[:, :, None])[
        :, :, 0
    ]
    return 2.0 * np.sum(rest * s, axis=1) - np.einsum("fi,fij,fj->f", rest, g, rest)


def normal_scores(statistic, directions, rest) -> np.ndarray:
    """F ratios with `directions` and `rest` degrees of freedom on the scale of a normal variable
    (Wilson & Hilferty 1931)."""
    one, two = 2.0 / (9.0 * directions), 2.0 / (9.0 * rest)
    root = np.cbrt(statistic)
    return ((1.0 - two) * root - (1.0 - one)) / np.sqrt(two * root**2 + one)
