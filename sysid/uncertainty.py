"""How sure each parameter is, and whether the data or the prior said it.

Residuals of smoothed signals are correlated over time, so the noise of the estimate is not taken from single samples
but from what leaving a whole block out would change (a jackknife, which also allows for blocks that few others stand
in for), with the products of neighbouring blocks, as correlation does not stop at a block's edge. The prior enters as
what it claims to know:

    d_b = (H - 2 R_b'R_b)^-1 s_b,      H = 2 R'R + P,  P the prior's Hessian, s_b the block's score,
    V = sum_b sum_l w_l d_b d_(b+l)',      w_l = 1 - l / (L + 1) up to l = L.

A fit takes its own share out of the noise, so that the scores of neighbouring blocks are against each other even where the
noise has no memory, while leaving blocks out exaggerates. What V is on average under white noise is known exactly, as is
what it should be, T = H^-1 M H^-1. So V is bent by the map A that takes E[V] to T, symmetric in coordinates where H is one:

    cov = t^2 A V A' + 2 sigma^2 H^-1 P H^-1,      G_b = 2 R_b'R_b,      M = sum_b M_b,
    E[s_b s_c'] = [b = c] M_b - G_b H^-1 M_c - M_b H^-1 G_c + G_b H^-1 M H^-1 G_c,

M_b the variance of block b's score under white noise of each joint's own size. And as few blocks leave V itself uncertain, t is
what two deviations of Student's law are to two of the normal one, with B / (1 + 2 sum_l w_l^2) degrees of freedom for B blocks:
two stated deviations hold 95 %. Two blocks say nothing of the noise's memory: there it is taken as white.

Source: Cameron & Miller 2015 (jackknife of clusters); Newey & West 1987 (neighbours); Bell & McCaffrey 2002 (the bias under
white noise and the degrees of freedom, there of blocks alone).
"""

from dataclasses import dataclass

import numpy as np

from .compress import Compressed
from .objective import Objective, add_blocks


@dataclass(frozen=True)
class Uncertainty:
    """covariance (size, size) in the parameters' units; std (size,), NaN where nothing determines a parameter;
    from_data (size,), the share of a parameter's variance that is measurement noise rather than the prior's
    width: 1 where the data alone determine it, 0 where only the prior does."""

    covariance: np.ndarray
    std: np.ndarray
    from_data: np.ndarray


def estimate(objective: Objective, compressed: Compressed, x: np.ndarray, fixed: np.ndarray, weights) -> Uncertainty:
    """Uncertainty at the optimum x (size,).

    Args:
        fixed: (size,) bool, parameters that were held, or sit at a bound; they get no std.
        weights: (joints,) of the fit, or None.
    """
    size = len(x)
    free = np.flatnonzero(~fixed)
    data = objective.data_hessian()
    prior = add_blocks(np.zeros((size, size)), objective.prior_hessian(x)) if objective.weight else np.zeros((size, size))
    misfit = objective.misfit(x)
    variance = float(misfit @ misfit) / max(int(compressed.rows.sum()) - len(free), 1)
    pick = np.ix_(free, free)
    inverse, undetermined = _inverse(data[pick] + prior[pick])
    covariance = np.full((size, size), np.nan)
    covariance[pick] = _noise(compressed, x, weights, data + prior, free) + 2.0 * variance * inverse @ prior[pick] @ inverse
    total = np.diagonal(inverse)
    from_noise = np.einsum("ij,jk,ki->i", inverse, data[pick], inverse)
    share = np.zeros(size)
    share[free] = np.where(undetermined, 0.0, np.clip(from_noise / np.where(total > 0, total, 1.0), 0.0, 1.0))
    std = np.full(size, np.nan)
    std[free] = np.where(undetermined, np.nan, np.sqrt(np.clip(np.diagonal(covariance)[free], 0.0, None)))
    return Uncertainty(covariance, std, share)


_FLAT = 1e-12  # eigenvalues that are none, as a share of the largest
# As the map keeps V right under white noise, more neighbours cost degrees of freedom alone, and noise whose memory is a block
# long needs them: with two, `scripts/coverage.py --colour 0.3` finds 88 % of a planar arm's combinations within two deviations.
_MOST_NEIGHBOURS, _BLOCKS_FOR_ONE, _FEWEST = 4, 10, 3


def _weights(blocks: int) -> dict[int, float]:
    """The weight of each neighbour by its distance: at most four, and one for every ten blocks."""
    most = min(_MOST_NEIGHBOURS, blocks // _BLOCKS_FOR_ONE)
    return {lag: 1.0 - lag / (most + 1) for lag in range(1, most + 1)}


def _noise(compressed: Compressed, x, weights, hessian, free) -> np.ndarray:
    """The covariance (free, free) that noise gives the estimate."""
    basis, moves, expected, right = _left_out(compressed, x, weights, hessian, free)
    if compressed.blocks < _FEWEST:
        return basis @ right @ basis.T
    bend = _map(expected, right)
    return basis @ bend @ _neighbours(moves) @ bend @ basis.T * _widening(compressed.blocks) ** 2


def _left_out(compressed: Compressed, x, weights, hessian, free):
    """In coordinates z, parameters = basis @ z, where the Hessian is one: the changes (blocks, z) of the estimate when a block
    is left out, to first order in the prior's curvature; what their `_neighbours` are on average under white noise of each
    joint's size; and the covariance that this noise has."""
    basis = _whitening(hessian[np.ix_(free, free)])
    count, size = compressed.blocks, basis.shape[1]
    scores = compressed.scores(x, weights)[:, free] @ basis
    noise = compressed.squares(x) / np.maximum(compressed.rows, 1)
    own, spread = np.zeros((2, count, size, size))
    place = np.full(len(x), -1)
    place[free] = np.arange(len(free))
    for factor in compressed.factors:
        scale = 2.0 if weights is None else 2.0 * weights[factor.joint] ** 2
        known = place[factor.columns] >= 0
        rows = factor.triangle[:, :-1][:, known] @ basis[place[factor.columns[known]]]
        square = scale * rows.T @ rows
        own[factor.block] += square
        spread[factor.block] += scale * noise[factor.joint] * square
    whole, shrink = spread.sum(axis=0), max(count - 1, 1) / count
    neighbours = _weights(count)
    moves, expected, seen = np.zeros((count, size)), np.zeros((size, size)), []
    for b in range(count):
        without = _inverse(np.eye(size) - own[b])[0]
        moves[b] = without @ scores[b]
        taken, given = without @ own[b], without @ spread[b]
        expected += given @ without
        seen.append((taken, given))
        for lag, weight in {0: 1.0, **neighbours}.items():
            if lag < len(seen):
                other = seen[-1 - lag]
                cross = (taken @ whole - given) @ other[0].T - taken @ other[1].T
                expected += 0.5 * weight * (cross + cross.T) * (1.0 if lag == 0 else 2.0)
        seen = seen[-max(neighbours, default=0) :] if neighbours else []
    return basis, moves * np.sqrt(shrink), shrink * expected, whole


# Of the noise's variance: directions that have less are the prior's, and are left as they are.
_NOISELESS = 1e-6


def _map(expected, right) -> np.ndarray:
    """The symmetric map A with A expected A = right, for positive semidefinite matrices that are much alike."""
    floor = _NOISELESS * np.trace(right) / max(len(right), 1) * np.eye(len(right))
    root, inverse = _roots(expected + floor)
    return inverse @ _roots(root @ (right + floor) @ root)[0] @ inverse


def _roots(matrix) -> tuple[np.ndarray, np.ndarray]:
    """The square root of a positive definite matrix and its inverse."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    values = np.sqrt(np.maximum(values, 1e-15 * max(values[-1], 1e-300)))
    return (vectors * values) @ vectors.T, (vectors / values) @ vectors.T


_TWO = 0.9772498680518208  # of the normal law lies below two deviations


def _widening(blocks: int) -> float:
    from scipy.special import stdtrit

    freedom = blocks / (1.0 + 2.0 * sum(weight**2 for weight in _weights(blocks).values()))
    return float(stdtrit(max(freedom, 1.0), _TWO)) / 2.0


def _neighbours(moves: np.ndarray) -> np.ndarray:
    total = moves.T @ moves
    for lag, weight in _weights(len(moves)).items():
        product = moves[:-lag].T @ moves[lag:]
        total = total + weight * (product + product.T)
    return total


def _whitening(hessian) -> np.ndarray:
    """A basis (size, range) with basis' hessian basis = 1."""
    scale = np.sqrt(np.where(np.diagonal(hessian) > 0.0, np.diagonal(hessian), 1.0))
    values, vectors = np.linalg.eigh(hessian / np.outer(scale, scale))
    kept = values >= _FLAT * values[-1]
    return vectors[:, kept] / np.sqrt(values[kept]) / scale[:, None]


def _inverse(hessian):
    """Inverse of a scaled positive semidefinite matrix on its range, and which parameters leave that range."""
    scale = np.sqrt(np.where(np.diagonal(hessian) > 0.0, np.diagonal(hessian), 1.0))
    values, vectors = np.linalg.eigh(hessian / np.outer(scale, scale))
    flat = values < _FLAT * values[-1]
    inverse = (vectors[:, ~flat] / values[~flat]) @ vectors[:, ~flat].T / np.outer(scale, scale)
    leaves = (np.sum(vectors[:, flat] ** 2, axis=1) > 1e-6) | (np.diagonal(hessian) <= 0.0)
    return inverse, leaves
