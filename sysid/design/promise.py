"""What a designed log will tell: deviations now and after, and which suspects it will tell apart.

Standard deviations are those of the fit's own estimator, (H^-1 S H^-1) with H the Hessian of data
and prior and S what noise makes of the gradient; what the fit itself says now is scaled by how the
formula falls.

A suspect a that is true leaves, of its torque s_a, what the model and its rival b cannot make
between them, lambda = min_x |s_a - X x|^2 over the noise, on the old logs and the new one together.
The log of the likelihood ratio is then normal with mean lambda / 2 and variance lambda, and a set
holds one name where it exceeds log 9.

Source: Atkinson & Fedorov 1975 (T-optimality); Wald 1943.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from ..estimate import Fit
from ..inertia import DIVERGENCES
from ..motion import Motion
from .information import own_size
from .noise import noise_of, size_of
from .suspects import Seen, Suspect

_ODDS = np.log(9.0)  # a set at 90 % holds one of two


@dataclass(frozen=True)
class Pair:
    """Two suspects, `effect:joint`, and the probability that the logs will tell them apart."""

    a: str
    b: str
    probability: float


def pairs(
    fit: Fit, suspects: Sequence[Suspect], old: Motion, new: Motion, samples: float
) -> list[Pair]:
    """How likely it is that each two suspects will be told apart by the old logs with the new one.

    Args:
        samples: of the new log.
    """
    seen = Seen.of(fit, old, old.samples), Seen.of(fit, new, samples)
    parts = [(one.rows, one.weights) for one in seen]
    blocks = [[one.columns(suspect) for suspect in suspects] for one in seen]
    prior = own_size(fit.model, fit.prior, fit.x, size_of(fit))
    out = []
    for i, a in enumerate(suspects):
        for j, b in enumerate(suspects[:i]):
            probability = min(
                _apart(
                    parts, prior, [own[k] for own in blocks], suspects[k].size,
                    [own[m] for own in blocks],
                )
                for k, m in ((i, j), (j, i))
            )  # fmt: skip
            out.append(Pair(b.named(fit.joints), a.named(fit.joints), probability))
    return out


def _apart(parts, prior, own, size, rival) -> float:
    """The probability that a suspect (columns a part) of a size is told from a rival."""
    square, cross, k = 0.0, 0.0, rival[0].shape[2]
    gram = np.zeros((len(prior) + k, len(prior) + k))
    gram[: len(prior), : len(prior)] = prior
    for (rows, weights), mine, other in zip(parts, own, rival):
        beside = np.concatenate([rows.columns, other], axis=2) * weights[:, None, None]
        signature = (mine @ size) * weights[:, None]
        flat = beside.reshape(-1, beside.shape[2])
        gram = gram + flat.T @ flat
        cross = cross + flat.T @ signature.ravel()
        square += float(np.sum(signature**2))
    scale = np.sqrt(np.maximum(np.diagonal(gram), 1e-300))
    x = np.linalg.lstsq(gram / np.outer(scale, scale), cross / scale, rcond=1e-12)[0] / scale
    left = max(square - float(cross @ x), 0.0)
    return float(ndtr((0.5 * left - _ODDS) / np.sqrt(left))) if left > 0.0 else 0.0


def deviations(fit: Fit, more: np.ndarray) -> dict[str, dict[str, float | None]]:
    """{parameter: {now, after}} of what a fit determines, its deviation now and with a new log.

    Args:
        more: (dof, size, size) of the new log's rows, C'C for each joint, in the fit's parameters;
            a joint none of whose rows counts takes no part.
    """
    counts = np.isfinite(noise := noise_of(fit))
    more = more * counts[:, None, None]
    size, weights = fit.model.size, np.ones(len(fit.joints)) if fit.weights is None else fit.weights
    old = np.zeros_like(more)
    for factor in fit.compressed.by_joint:
        pick = np.ix_([factor.joint], factor.columns, factor.columns)
        r = factor.triangle[:, :-1]
        old[pick] += (r.T @ r)[None]
    variance = np.where(counts, noise, 0.0) ** 2 * weights**4
    beside = np.zeros((size, size))
    if fit.experiment.prior.weight:
        metric = _prior(fit)
        for b, block in enumerate(metric):
            beside[10 * b : 10 * b + 10, 10 * b : 10 * b + 10] = 0.5 * block
    free = np.isfinite(fit.uncertainty.std)

    def spread(grams):
        hessian = np.einsum("j,jab->ab", weights**2, grams) + beside
        noise = np.einsum("j,jab->ab", variance, grams)
        h, s = hessian[np.ix_(free, free)], noise[np.ix_(free, free)]
        scale = 1.0 / np.sqrt(np.maximum(np.diagonal(h), 1e-300))
        inverse = np.linalg.pinv(h * np.outer(scale, scale), rcond=1e-13) * np.outer(scale, scale)
        typical = float(np.mean(variance[variance > 0.0])) if variance.any() else 1.0
        total = inverse @ (s + typical * beside[np.ix_(free, free)]) @ inverse
        return np.sqrt(np.maximum(np.diagonal(total), 0.0))

    now, after = spread(old), spread(old + more)
    names = [name for name, kept in zip(fit.model.names, free) if kept]
    std = fit.uncertainty.std[free]
    share = np.divide(after, now, out=np.ones_like(now), where=now > 0.0)
    return {
        name: {"now": float(s), "after": float(s * min(r, 1.0))}
        for name, s, r in zip(names, std, share)
    }


def _prior(fit: Fit) -> np.ndarray:
    divergence = DIVERGENCES[fit.experiment.prior.divergence](fit.prior)
    return fit.experiment.prior.weight * np.asarray(divergence.hessian(fit.pi))
