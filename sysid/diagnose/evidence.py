"""One statistic for every candidate, as sums over blocks of time.

A group is the columns of one candidate at one set of shape values, projected off everything in the
model and made orthonormal. Over blocks b:

    s_b = Q_b' r_b - (what the angles' noise makes of it),   G_b = Q_b' Q_b
    c = sum_b s_b                         its coefficients; the last block, in no fold, is the prior
    a_b, A_b                              s_b, G_b of noise as loud as before the model's own fit
    m_b = (1 - G_b)^-1 (a_b - A_b c)      how far they move when a block is left out
    T = c'c / sum_b |m_b|^2               is it there?
    c_f = (1 - G_f)^-1 (c - s_f)          its coefficients without a fold f
    gain = sum_f 2 c_f' s_f - c_f' G_f c_f   what does it take of what it was not fitted on?

T is told on the scale of a normal variable: groups that rest on few blocks and on many compare.

The noise of the angles stands in residual and columns alike, which neither blocks nor folds see.
Drawn once more, what it adds to columns times what it adds to the residual has the mean of what the
first one left in s_b, and is taken off (simulation extrapolation: Cook & Stefanski 1994).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .. import blocks, eigen
from ..candidate_columns import signs_allow
from ..candidates import Candidate


@dataclass(frozen=True)
class Group:
    """One candidate at shape values. scores (blocks, k), squares (blocks, k, k) of the orthonormal
    columns, the prior's last, `loud` and `loud_squares` the same of rows whose noise is as loud as
    before the model's fit; `back` (k0, k) turns coefficients of these into the
    candidate's own; `sizes` (k0,) the weighted norm of what the model leaves of each own column;
    `foreseen` (k, k) the scores' covariance, were the noise always the same; `loss` the squared
    residual of its joints; `whole` the group that this one is a part of, None where it is all;
    slow: of columns that are mostly noise, what is as slow as the motion."""

    candidate: Candidate
    shapes: dict[str, float]
    scores: np.ndarray
    squares: np.ndarray
    loud: np.ndarray
    loud_squares: np.ndarray
    back: np.ndarray
    sizes: np.ndarray
    foreseen: np.ndarray
    loss: float
    whole: Group | None = None
    slow: bool = False

    @cached_property
    def c(self) -> np.ndarray:
        """(k,) coefficients of the orthonormal columns."""
        return self.scores.sum(0)

    @cached_property
    def taken(self) -> float:
        """What it takes of the weighted squared residual of blocks held apart from it."""
        return float(blocks.gains(self.c, self.scores, self.squares).sum())

    @cached_property
    def moves(self) -> np.ndarray:
        """(blocks, k) how far they move when a block is left out."""
        return blocks.moves(self.c, self.loud, self.loud_squares, self.squares)

    @property
    def variance(self) -> float:
        """Of the coefficient of one direction."""
        return float(np.sum(self.moves**2) / len(self.c))

    @cached_property
    def spreads(self) -> tuple[float, float, float]:
        """The moves' sum of squares, what it would be were the noise always the same (that of the
        residual without what the group takes; of the prior, its own move), and the first one's
        degrees of freedom."""
        whole = self.whole or self  # what it does not take, no part of it takes either
        left = 1.0 - np.clip(whole.taken / max(self.loss, 1e-300), 0.0, blocks.LEVERAGE)
        directions, rest = self.freedom
        own, squared = directions * max(rest - 1.0, 1.0), np.sum(self.moves**2, axis=1)
        return float(squared.sum()), float(np.trace(self.foreseen) * left + squared[-1]), own

    @cached_property
    def freedom(self) -> tuple[float, float]:
        """Degrees of freedom: directions that take part (Satterthwaite 1946), and blocks that they
        rest on."""
        return float(blocks.taking_part(self.moves)), blocks.resting(self.squares[:-1])

    @cached_property
    def testable(self) -> bool:
        """Whether it rests on enough blocks to be told from chance; if not, it may still be a rival
        of one that is."""
        return bool(blocks.many(self.squares[:-1]))

    @cached_property
    def tested(self) -> Group:
        """The group by which it is told whether it is there: without directions of which one block
        holds nearly all; of what rests on few blocks or comes in blows, with no block that counts
        more than the rest allows. Choices that look at columns alone leave scores of noise without
        a sign. What it takes, and its coefficients, are the group's own."""
        if self.testable and not self.candidate.blows:
            return self
        turn = blocks.shared(self.squares[:-1], blocks.LEVERAGE)
        group = self if turn.shape[1] in (0, len(turn)) else self._turned(turn)
        share = np.einsum("bkk->b", group.squares[:-1])
        weight = blocks.evening(share)
        if weight.min() == 1.0 or (group.testable and not self.candidate.blows):
            return group
        w = np.append(weight, 1.0)[:, None]
        squares = group.squares * w[:, None]
        values, vectors = eigen.symmetric(squares.sum(0))
        if np.linalg.eigvalsh(squares[:-1].sum(0) - squares[-1]).min() < 1e-6:
            return self  # the prior would tell most of it
        told = {"scores": w * group.scores, "loud": w * group.loud, "squares": squares}
        told["foreseen"] = group.foreseen * np.sum(weight**2 * share) / share.sum()
        told |= {"loud_squares": w[:, None] * group.loud_squares, "whole": group.whole or self}
        even = replace(group, **told)
        return even._turned(vectors / np.sqrt(values))

    def _turned(self, turn: np.ndarray) -> Group:
        """The group in directions (k, l) of its own."""
        own = np.linalg.pinv(self.back)  # (k, k0) what its own columns are in its directions
        left, whole = (np.linalg.norm(a, axis=0) for a in (np.linalg.pinv(turn) @ own, own))
        return replace(
            self,
            scores=self.scores @ turn,
            squares=turn.T @ self.squares @ turn,
            loud=self.loud @ turn,
            loud_squares=turn.T @ self.loud_squares @ turn,
            foreseen=turn.T @ self.foreseen @ turn,
            back=self.back @ turn,
            sizes=self.sizes * left / np.maximum(whole, 1e-300),
            whole=self.whole or self,
        )

    @property
    def signed(self) -> bool:
        """Whether the coefficients have the signs that the effect allows."""
        return signs_allow(self.candidate, self.coefficients)

    @property
    def numbers(self) -> int:
        """How many numbers it fits: its directions, and shape values that were searched."""
        return len(self.c) + (0 if self.candidate.nonlinear else len(self.shapes))

    @property
    def either(self) -> int:
        """How many of its numbers may have either sign, none that does nothing."""
        shapes, own = self.candidate.effect.shapes(), self.candidate.effect.coefficients()
        either = sum(s.low < 0.0 < s.high for s in shapes) + sum(c.lower != 0 for c in own)
        return max(min(either - int(np.sum(self.sizes == 0.0)), self.numbers), 0)

    @property
    def coefficients(self) -> np.ndarray:
        """(k0,) the candidate's own."""
        return self.back @ self.c


def known_together(groups: list[Group]) -> None:
    """What every group is asked for, of all with as many directions at once: many small products
    are one large one. Each keeps its own, as if it had been asked by itself."""
    by_size: dict[tuple, list[Group]] = {}
    for group in groups:
        by_size.setdefault(group.scores.shape, []).append(group)
    for own in by_size.values():
        what = ("scores", "squares", "loud", "loud_squares")
        scores, squares, *loud = (np.stack([getattr(g, name) for g in own]) for name in what)
        c = scores.sum(-2)
        moves = blocks.moves(c, *loud, squares)
        freedom = zip(blocks.taking_part(moves), blocks.resting(data := squares[:, :-1]))
        told = moves, blocks.gains(c, scores, squares).sum(-1), freedom, blocks.many(data).tolist()
        for group, *found in zip(own, c, *told):
            vars(group).update(zip(("c", "moves", "taken", "freedom", "testable"), found))
