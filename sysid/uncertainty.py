"""How sure each parameter is, and whether the data or the prior said it.

The prior enters as what it claims to know, noise as blocks of time know it (`blocks.covariance`):

    cov = C + 2 sigma^2 w H^-1 P H^-1,      H = 2 R'R + P,  P the prior's Hessian, C the noise's.

A strong prior is chosen for what it does to the error; it does not know the bodies better for it. However
strong, it claims no more than that they are within a factor of the URDF's (`prior_weight.weakest`): w is
its weight over that of a prior that claims as much, or one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from . import blocks, eigen
from .objective import Objective, add_blocks
from .prior_weight import weakest
from .projection import told
from .triangles import Compressed


@dataclass(frozen=True)
class Uncertainty:
    """covariance (size, size) in the parameters' units; std (size,), NaN where nothing determines a
    parameter; from_data (size,), the share of a parameter's variance that is measurement noise
    rather than the prior's width: 1 where the data alone determine it, 0 where only the prior
    does."""

    covariance: np.ndarray
    std: np.ndarray
    from_data: np.ndarray

    def told_elsewhere(self, numbers: Sequence[int], square: np.ndarray) -> Uncertainty:
        """The same where some parameters have the covariance (k, k) that other rows tell: all
        others follow them as they do here."""
        known = np.isfinite(self.std)
        own = np.array([n for n, k in enumerate(numbers) if known[k]], dtype=int)
        if not len(own):
            return self
        at, inner = np.array(numbers)[own], np.flatnonzero(known)
        covariance = self.covariance.copy()
        before = covariance[np.ix_(at, at)]
        way = covariance[np.ix_(inner, at)] @ np.linalg.pinv(before, hermitian=True)
        covariance[np.ix_(inner, inner)] += way @ (square[np.ix_(own, own)] - before) @ way.T
        spread = np.sqrt(np.clip(np.diagonal(covariance), 0.0, None))
        return replace(self, covariance=covariance, std=np.where(known, spread, self.std))


def estimate(objective: Objective, compressed: Compressed, x: np.ndarray, fixed: np.ndarray, weights, bound=(), room=None) -> Uncertainty:
    """Uncertainty at the optimum x (size,).

    Args:
        fixed: (size,) bool, parameters that were held; they get no std.
        weights: (joints,) of the fit, or None.
        bound: numbers of those that sit at zero, which they may not pass. They get none either, but are not known for it.
        room: (2, size) how far each may go down and up, infinite where nothing holds it; None: nowhere.
    """
    size = len(x)
    bound = np.array(bound, dtype=int)
    free = np.setdiff1d(np.flatnonzero(~fixed), bound)
    data = objective.data_hessian()
    prior = add_blocks(np.zeros((size, size)), objective.prior_hessian(x)) if objective.weight else np.zeros((size, size))
    misfit = objective.misfit(x)
    variance = float(misfit @ misfit) / max(int(compressed.rows.sum()) - len(free), 1)
    pick = np.ix_(free, free)
    least = weakest(variance) if objective.divergence.relative else np.inf
    claim = max(1.0, objective.weight / least) if least > 0.0 else 1.0
    inverse, undetermined = _inverse(data[pick] + prior[pick])
    covariance = np.full((size, size), np.nan)
    covariance[pick] = _noise(compressed, x, weights, data[pick], prior[pick], free) * _widened(compressed, free) + 2.0 * variance * claim * inverse @ prior[pick] @ inverse
    if len(bound):
        covariance[pick] += _of_bound(objective, compressed, x, weights, data, prior, inverse, free, bound, room)
    total = np.diagonal(inverse)
    from_noise = np.einsum("ij,jk,ki->i", inverse, data[pick], inverse)
    share = np.zeros(size)
    share[free] = np.where(undetermined, 0.0, np.clip(from_noise / np.where(total > 0, total, 1.0), 0.0, 1.0))
    std = np.full(size, np.nan)
    std[free] = np.where(undetermined, np.nan, np.sqrt(np.clip(np.diagonal(covariance)[free], 0.0, None)))
    return Uncertainty(covariance, std, share)


def _of_bound(objective, compressed: Compressed, x, weights, data, prior, inverse, free, bound, room) -> np.ndarray:
    """(free, free) what is added by parameters that are at zero and may be above it: friction that went to zero, as others do all that
    it would, makes these no surer.

    Without its bound a parameter would be where its slope points, below zero, with a deviation. Of that normal law the part counts that
    is above zero, as far as none of the others, which follow as the Hessian says, comes to a bound of its own.
    """
    both, count = np.concatenate([free, bound]), len(free)
    hessian = (data + prior)[np.ix_(both, both)]
    follow = -inverse @ hessian[:count, count:]
    own, undetermined = _inverse(hessian[count:, count:] + hessian[count:, :count] @ follow)
    square = _noise(compressed, x, weights, data[np.ix_(both, both)], prior[np.ix_(both, both)], both) * _widened(compressed, both)
    square = square[count:, count:]
    deviation = np.sqrt(np.clip(np.diagonal(square), 0.0, None))
    known = ~undetermined & (deviation > 0.0)
    below = np.clip(own @ objective.gradient(x)[bound], 0.0, None)
    # one that follows by less than a hundredth of its own doubt, or stands at a bound itself, holds nothing back
    spread = np.sqrt(np.clip(np.diagonal(inverse), 0.0, None))
    moves = np.abs(follow) * np.sqrt(np.clip(np.diagonal(own), 0.0, None)) > _FAINT * spread[:, None]
    most = np.full(len(bound), np.inf) if room is None else _before_bounds(np.where(moves, follow, 0.0), *room[:, free])
    share = [_root_mean_square(*own) if told else 0.0 for *own, told in zip(below, most, deviation, known)]
    return follow @ (np.outer(share, share) * square) @ follow.T


def _before_bounds(follow, down, up) -> np.ndarray:
    """How far (bound,) parameters may go up until one of those (free,) that follow has gone as far down or up as it may."""
    there = (follow != 0.0) & (np.minimum(down, up) > 0.0)[:, None]
    way = np.where(follow < 0.0, down[:, None], up[:, None])
    return np.min(np.where(there, way / np.where(there, np.abs(follow), 1.0), np.inf), axis=0, initial=np.inf)


def _root_mean_square(below: float, most: float, deviation: float) -> float:
    """Of the part of a normal law about -`below` that lies between zero and `most`, about zero, in deviations."""
    u = np.linspace(0.0, min(most / deviation, _FAR), _POINTS)
    weight = np.exp(-u * (0.5 * u + below / deviation))
    return float(np.sqrt(np.sum(weight * u**2) / np.sum(weight)))


def _widened(compressed: Compressed, free) -> np.ndarray:
    """(free, free) by which parameters that some blocks alone tell are less certain than those that all do: by Student's law of
    so many blocks."""
    told = np.maximum(compressed.told[free], 1)
    known = {int(count): blocks.widening(int(count)) for count in {*told, compressed.blocks}}
    share = np.array([known[int(count)] for count in told]) / known[compressed.blocks]
    return np.outer(share, share)


_FAR, _POINTS = 6.0, 400  # deviations of a normal law, and steps over them
_FAINT = 0.01  # of its own deviation: so little of what follows is none
_FLAT = 1e-12  # eigenvalues that are none, as a share of the largest


def _noise(compressed: Compressed, x, weights, data, prior, free) -> np.ndarray:
    """The covariance (free, free) that noise gives the estimate; of directions that no data tell it says nothing."""
    basis = told(data, data + prior)
    return basis @ blocks.covariance(*by_block(compressed, x, weights, basis, free)) @ basis.T


def by_block(compressed: Compressed, x, weights, basis, free):
    """In coordinates z, parameters = basis @ z, where the Hessian is one: each block's score
    (blocks, z) and share of the Hessian (blocks, z, z), and the variance of its score under white
    noise of each joint's own size."""
    scores = compressed.scores(x, weights)[:, free] @ basis
    noise = compressed.squares(x) / np.maximum(compressed.rows, 1)
    own, spread = np.zeros((2, compressed.blocks, basis.shape[1], basis.shape[1]))
    place = np.full(len(x), -1)
    place[free] = np.arange(len(free))
    for factor in compressed.factors:
        scale = 2.0 if weights is None else 2.0 * weights[factor.joint] ** 2
        known = place[factor.columns] >= 0
        rows = factor.triangle[:, :-1][:, known] @ basis[place[factor.columns[known]]]
        square = scale * rows.T @ rows
        own[factor.block] += square
        spread[factor.block] += scale * noise[factor.joint] * square
    return scores, own, spread


def whitening(hessian) -> np.ndarray:
    """A basis (size, range) with basis' hessian basis = 1."""
    scale = np.sqrt(np.where(np.diagonal(hessian) > 0.0, np.diagonal(hessian), 1.0))
    values, vectors = eigen.symmetric(hessian / np.outer(scale, scale))
    kept = values >= _FLAT * values.max(initial=0.0)
    return vectors[:, kept] / np.sqrt(values[kept]) / scale[:, None]


def _inverse(hessian):
    """Inverse of a scaled positive semidefinite matrix on its range, and which parameters leave
    that range."""
    scale = np.sqrt(np.where(np.diagonal(hessian) > 0.0, np.diagonal(hessian), 1.0))
    values, vectors = eigen.symmetric(hessian / np.outer(scale, scale))
    flat = values < _FLAT * values[-1]
    inverse = (vectors[:, ~flat] / values[~flat]) @ vectors[:, ~flat].T / np.outer(scale, scale)
    leaves = (np.sum(vectors[:, flat] ** 2, axis=1) > 1e-6) | (np.diagonal(hessian) <= 0.0)
    return inverse, leaves
