"""Rows of any number -> the small triangle R with ||A v|| = ||R v|| for every v: two kernels.

Householder's QR is exact to rounding whatever the rows are, and slow on tall matrices: it goes over
them column by column. Products A'A go at a matrix library's speed, but square the condition number:
at 1e8 a digit or two are left of the weakest direction, with Householder's eight. So the rows are
first divided by a triangle that nearly is theirs, that of the first part of them,

    B = A P^-1,    A'A = P' (B'B) P,

whose condition is near one: what is lost in B'B is rounding of numbers near one, and the weakest
direction of A has as many digits as with Householder's QR. Rows that go far beyond what P has seen
(a joint that had stood still and now moves) are taken by Householder's, and are in P from then on.

Source: Fukaya et al. 2020 (shifted Cholesky QR); Fan, Guo & Lin 2021 (preconditioned by a sample).
"""

from __future__ import annotations

import numpy as np

from . import eigen

# Of rows over P, squared: a direction in which they are beyond it costs as many digits of others.
_BEYOND = 1e3
# Of the sum of squares over P before P is renewed, for the same reason.
_MOST = 1e4
# A share of the largest column that P has in every direction: none that it saw nothing of is
# divided by nothing. What is less, rounding made.
_FLOOR = 1e-10
# Rows a column: with fewer the triangle is most of the work.
_FEW = 4


def triangle(rows: np.ndarray) -> np.ndarray:
    """The R factor (min(n, k), k) of rows (n, k) by Householder's QR; overwrites a Fortran-ordered
    argument."""
    from scipy.linalg.lapack import dgeqrf

    if rows.shape[0] == 0:
        return np.zeros((0, rows.shape[1]))
    factor = dgeqrf(np.asfortranarray(rows), overwrite_a=1)[0]
    return np.triu(factor[: min(rows.shape)])


class Reduction:
    """The triangle of rows that come in parts, and how many they are. Changes as they come."""

    def __init__(self) -> None:
        self.rows = 0
        self._known: np.ndarray | None = None  # triangle of what is not in `_gram`
        self._over: np.ndarray | None = None  # P
        self._gram: np.ndarray | None = None  # sum of B'B, upper half

    def add(self, rows: np.ndarray) -> None:
        """Take n rows of k numbers, given as columns (k, n) with samples last; may be
        overwritten."""
        from scipy.linalg.blas import dsyrk, dtrsm

        self.rows += rows.shape[1]
        if self._known is None or rows.shape[1] < _FEW * len(rows):
            self._take(rows)
            return
        if self._over is None:
            self._over = _invertible(self._known)
        rest = dtrsm(1.0, self._over, rows.T, side=1)
        gram = dsyrk(1.0, rest, trans=1)
        largest = float(np.diagonal(gram).max())
        if not largest <= _BEYOND:
            self._take(rows)
            return
        self._gram = gram if self._gram is None else self._gram + gram
        if np.diagonal(self._gram).max() > _MOST:
            self._fold()

    def _take(self, rows: np.ndarray) -> None:
        self._fold()
        above = [] if self._known is None else [self._known]
        self._known = triangle(np.concatenate([*above, rows.T]) if above else rows.T)

    def _fold(self) -> None:
        """Bring the products into the triangle."""
        if self._gram is not None:
            # a column of nothing stays one: no rounding of the others comes into it
            nothing = ~self._known.any(axis=0) & (np.diagonal(self._gram) == 0.0)
            rows = _root(self._gram) @ self._over
            rows[:, nothing] = 0.0
            self._known = triangle(np.concatenate([self._known, rows]))
        self._over = self._gram = None

    def triangle(self) -> np.ndarray:
        """The R factor (min(n, k), k) of all rows."""
        self._fold()
        return self._known


def _invertible(known: np.ndarray) -> np.ndarray:
    """A triangle (k, k) with something in every direction."""
    size = np.linalg.norm(known, axis=0)
    least = _FLOOR * np.maximum(size, size.max() or 1.0)
    return triangle(np.concatenate([known, np.diag(least)]))


def _root(gram: np.ndarray) -> np.ndarray:
    """C (k, k) with C'C the positive semidefinite matrix whose upper half is given."""
    values, vectors = eigen.symmetric(gram.T)
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
