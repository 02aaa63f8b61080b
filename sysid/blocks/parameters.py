"""How sure the parameters of a fit are together, whose residuals are correlated over time.

The noise of the estimate is what leaving a whole block out would change (a jackknife, which also
allows for blocks that few others stand in for), with the products of neighbouring blocks, as
correlation does not stop at a block's edge. In coordinates where the Hessian is one:

    d_b = (1 - G_b)^-1 s_b,      s_b the block's score, G_b its share of the Hessian,
    V = sum_b sum_l w_l d_b d_(b+l)',      w_l = 1 - l / (L + 1) up to l = L.

A fit takes its own share out of the noise, so that the scores of neighbouring blocks are against
each other even where the noise has no memory, while leaving blocks out exaggerates. What V is on
average under white noise is known exactly, as is what it should be, M = sum_b M_b, M_b the variance
of block b's score under white noise:

    E[s_b s_c'] = [b = c] M_b - G_b M_c - M_b G_c + G_b M G_c.

So V is bent by the symmetric map A that takes E[V] to M, and the covariance is t^2 A V A'. As few
blocks leave V itself uncertain, t is what two deviations of Student's law are to two of the normal
one, with B / (1 + 2 sum_l w_l^2) degrees of freedom for B blocks: two stated deviations hold 95 %.
Two blocks say nothing of the noise's memory: there it is taken as white.

Source: Cameron & Miller 2015 (jackknife of clusters); Newey & West 1987 (neighbours); Bell &
McCaffrey 2002 (the bias under white noise and the degrees of freedom, there of blocks alone).
"""

from __future__ import annotations

import numpy as np

from .. import eigen

# As the map keeps V right under white noise, more neighbours cost degrees of freedom alone, and
# noise whose memory is a block long needs them: with two, `scripts/coverage.py --colour 0.3` finds
# 88 % of a planar arm's combinations within two deviations.
_MOST_NEIGHBOURS, _BLOCKS_FOR_ONE, _FEWEST = 4, 10, 3
# Of the noise's variance: directions that have less are the prior's, and are left as they are.
_NOISELESS = 1e-6
_FLAT = 1e-12  # eigenvalues that are none, as a share of the largest
_MANY = 1e6  # degrees of freedom of noise that is taken as white
_ALIKE = 1e-9  # of the largest: values so alike say one thing
_TWO = 0.9772498680518208  # of the normal law lies below two deviations


def covariance(scores, own, spread) -> np.ndarray:
    """The covariance (z, z) that noise gives an estimate, in coordinates where the Hessian is one.

    Args:
        scores: (blocks, z) gradient of each block's share of the objective at the optimum.
        own: (blocks, z, z) each block's share of the Hessian. spread: (blocks, z, z) variance of
            its score under white noise.
    """
    count = len(scores)
    if count < _FEWEST:
        return spread.sum(axis=0)
    moves, expected = left_out(scores, own, spread)
    bend = _map(expected, spread.sum(axis=0))
    return bend @ neighbours(moves) @ bend * widening(count) ** 2


def left_out(scores, own, spread) -> tuple[np.ndarray, np.ndarray]:
    """The changes (blocks, z) of the estimate when a block is left out, to first order in the
    prior's curvature; and what their `neighbours` are on average under white noise."""
    count, size = scores.shape
    whole, shrink = spread.sum(axis=0), max(count - 1, 1) / count
    weights = _weights(count)
    # a block may hold all that is known of a direction: nothing is left of it then
    without = np.linalg.pinv(np.eye(size) - own, rcond=_FLAT, hermitian=True)
    outer = lambda a, b: np.tensordot(a, b, ((0, 2), (0, 2)))  # noqa: E731 - sum_b a_b b_b'
    moves = np.einsum("bkl,bl->bk", without, scores)
    taken, given = without @ own, without @ spread
    expected = outer(given, without)
    for lag, weight in {0: 1.0, **weights}.items():
        first, then = slice(0, count - lag), slice(lag, count)
        cross = outer(taken[then] @ whole - given[then], taken[first])
        cross -= outer(taken[then], given[first])
        expected += 0.5 * weight * (cross + cross.T) * (1.0 if lag == 0 else 2.0)
    return moves * np.sqrt(shrink), shrink * expected


def neighbours(moves: np.ndarray) -> np.ndarray:
    """Products of moves (blocks, z) of a block and, weighted by distance, of its neighbours."""
    total = moves.T @ moves
    for lag, weight in _weights(len(moves)).items():
        product = moves[:-lag].T @ moves[lag:]
        total = total + weight * (product + product.T)
    return total


def widening(blocks: int) -> float:
    """What two deviations of Student's law are to two of the normal one."""
    from scipy.special import stdtrit

    return float(stdtrit(_freedom(blocks), _TWO)) / 2.0


def clear(values: np.ndarray, covariance: np.ndarray, blocks: int) -> bool:
    """Whether any of values (k,), or all together, are farther from zero than chance makes a single
    one as seldom as two deviations: values that trade with each other may each be nothing beside
    its own. Half of that chance is for each of the two questions.

    Args:
        covariance: (k, k), as of `covariance`, of so many blocks; values without a deviation take
            no part.

    Source: Hotelling 1931; Dunn 1961 (the largest of several).
    """
    from scipy.special import fdtri

    variance = np.diagonal(covariance)
    known = np.isfinite(variance) & (variance > 0.0)
    if not known.any():
        return False
    spread, level = np.sqrt(variance[known]), 2.0 * (1.0 - _TWO)
    z, alike = values[known] / spread, covariance[np.ix_(known, known)] / np.outer(spread, spread)
    shares, directions = eigen.symmetric(alike)
    told = shares > _ALIKE * shares[-1]
    m, k, freedom = int(told.sum()), len(z), _freedom(blocks) if blocks >= _FEWEST else _MANY

    def squared(m: int, chance: float) -> float:
        """What the square of m values together is beyond with some chance, in units in which a
        deviation is told: two are as likely as two of a normal one."""
        rest = freedom - m + 1.0
        own = m * freedom / rest * fdtri(m, rest, 1.0 - chance) if rest > 0.0 else np.inf
        return 4.0 * own / fdtri(1, freedom, 1.0 - level)

    if m == 1:
        return bool(np.max(z**2) > squared(1, level))
    together = np.sum((directions[:, told].T @ z) ** 2 / shares[told])
    return bool(np.max(z**2) > squared(1, 0.5 * level / k) or together > squared(m, 0.5 * level))


def _freedom(blocks: int) -> float:
    """Degrees of freedom of a covariance of so many blocks."""
    return max(blocks / (1.0 + 2.0 * sum(w**2 for w in _weights(blocks).values())), 1.0)


def _weights(blocks: int) -> dict[int, float]:
    """The weight of each neighbour by its distance: at most four, and one for every ten blocks."""
    most = min(_MOST_NEIGHBOURS, blocks // _BLOCKS_FOR_ONE)
    return {lag: 1.0 - lag / (most + 1) for lag in range(1, most + 1)}


def _map(expected, right) -> np.ndarray:
    """The symmetric map A with A expected A = right, for positive semidefinite matrices that are
    much alike."""
    floor = _NOISELESS * np.trace(right) / max(len(right), 1) * np.eye(len(right))
    root, inverse = _roots(expected + floor)
    return inverse @ _roots(root @ (right + floor) @ root)[0] @ inverse


def _roots(matrix) -> tuple[np.ndarray, np.ndarray]:
    """The square root of a positive definite matrix and its inverse."""
    values, vectors = eigen.symmetric(0.5 * (matrix + matrix.T))
    values = np.sqrt(np.maximum(values, 1e-15 * max(values[-1], 1e-300)))
    return (vectors * values) @ vectors.T, (vectors / values) @ vectors.T
