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

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr

from ..candidates import Candidate, columns_of, tried
from ..estimate import Fit
from ..inertia import DIVERGENCES
from ..model import ROBOT
from ..motion import Motion
from ..rows import stack
from ..source import Source
from .columns import piece
from .information import noise_of, own_size, size_of

_ODDS = np.log(9.0)  # a set at 90 % holds one of two
_RATE = 50.0  # Hz of the rows that pairs are asked on
_TYPICAL = 0.03  # of the joint's torque: the size of an effect of which no log says any


@dataclass(frozen=True)
class Pair:
    """Two suspects, `effect:joint`, and the probability that the logs will tell them apart."""

    a: str
    b: str
    probability: float


def spelled(candidate: Candidate, joints) -> str:
    """`effect:joint`, as `--separate` has it."""
    return f"{candidate.name}:{'*' if candidate.joint == ROBOT else joints[candidate.joint]}"


def played(q, qd, qdd, step: float, template: Motion, levels: Mapping[str, str]) -> Motion:
    """A designed motion (n, dof) as the motion of a log at {group: level}."""
    own = replace(piece(q, qd, qdd, step), levels=levels)
    rest = np.zeros(q.shape[1])
    return Motion(template.joints, (own,), (), rest, rest.astype(int))


def pairs(
    fit: Fit, suspects: list[Candidate], old: Motion, new: Motion, samples: float
) -> list[Pair]:
    """How likely it is that each two suspects will be told apart by the old logs with the new one.

    Args:
        samples: of the new log.
    """
    noise = noise_of(fit)
    parts = []
    for motion, count in ((old, old.samples), (new, samples)):
        stride = max(1, int(round(1.0 / (_RATE * motion.pieces[0].step))))
        rows = stack(fit.model, motion, stride)
        source = Source(fit.model.scaled_by(motion), fit.x, motion, stride, rows.use)
        parts.append((rows, source, np.sqrt(count / max(len(rows.t), 1)) / noise))
    shapes = [_shapes(parts[0], fit, suspect) for suspect in suspects]
    blocks = [[_columns(part, s, at) for s, at in zip(suspects, shapes)] for part in parts]
    sizes = [_size(fit, parts[0], own, s) for own, s in zip(blocks[0], suspects)]
    prior = own_size(fit.model, fit.prior, fit.x, size_of(fit))
    out = []
    for i, a in enumerate(suspects):
        for j, b in enumerate(suspects[:i]):
            probability = min(
                _apart(
                    parts, prior, [own[k] for own in blocks], sizes[k], [own[m] for own in blocks]
                )
                for k, m in ((i, j), (j, i))
            )
            out.append(Pair(spelled(b, fit.joints), spelled(a, fit.joints), probability))
    return out


def _shapes(part, fit: Fit, suspect: Candidate) -> dict[str, float]:
    """The shape values of a suspect that take most of what the first logs leave."""
    rows, source, _ = part
    left = rows.residual(fit.x)
    asked = tried(source, suspect)  # which looks at the model's scales alone
    return max(asked, key=lambda at: _taken(_columns(part, suspect, at), left, part[2]))


def _columns(part, suspect: Candidate, at: dict[str, float]) -> np.ndarray:
    """(dof, n, k) of a suspect on every joint."""
    rows, source, _ = part
    found = columns_of(source, suspect, [at])[0]
    if len(found) == rows.tau.shape[1]:
        return found
    out = np.zeros((rows.tau.shape[1], *found.shape[1:]))
    out[suspect.joint] = found[0]
    return out


def _taken(columns, left, weights) -> float:
    flat = (columns * weights[:, None, None]).reshape(-1, columns.shape[2])
    target = (left * weights).T.ravel()
    size = np.linalg.norm(flat, axis=0)
    if not np.all(np.isfinite(flat)) or not size.any():
        return -1.0
    kept = flat[:, size > 0] / size[size > 0]
    return float(np.linalg.norm(kept @ np.linalg.lstsq(kept, target, rcond=1e-8)[0]))


def _size(fit: Fit, part, columns, suspect: Candidate) -> np.ndarray:
    """(k,) likely coefficients of a suspect: those that the first logs suggest, at least a few per
    cent of the joint's torque."""
    rows, _, weights = part
    flat = (columns * weights[:, None, None]).reshape(-1, columns.shape[2])
    target = (rows.residual(fit.x) * weights).T.ravel()
    found = np.linalg.lstsq(flat, target, rcond=1e-8)[0]
    made = np.sqrt(np.mean((columns @ found) ** 2))
    least = _TYPICAL * np.sqrt(np.mean(rows.tau**2))
    return found * max(1.0, least / made) if made > 0.0 else np.ones(columns.shape[2])


def _apart(parts, prior, own, size, rival) -> float:
    """The probability that a suspect (columns a part) of a size is told from a rival."""
    square, cross, k = 0.0, 0.0, rival[0].shape[2]
    gram = np.zeros((len(prior) + k, len(prior) + k))
    gram[: len(prior), : len(prior)] = prior
    for (rows, _, weights), mine, other in zip(parts, own, rival):
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
