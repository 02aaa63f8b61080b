"""What a designed log will tell: deviations now and after, and which suspects it will tell apart.

Standard deviations are what noise makes of the fit's own estimate, to first order:

    cov = H^-1 (sum_j w_j^4 C_j' N_j C_j + s^2 prior) H^-1,    H = sum_j w_j^2 C_j' C_j + prior,

over the rows of the old logs and of the new one, filtered as a fit filters them, with those left out
that it leaves out. The prior says that bodies are as near the URDF's as makes the old logs likeliest
(`likely_prior`), whatever weight the poor log was fitted under. N_j is the covariance of joint j's
noise, whose spectrum the first fit's residual of all logs tells (`spectrum`). What a fit of few blocks
states of its own deviations, from their spread, is uncertain by a third: it allows for noise of any
kind, and for what a model lacks.

A suspect a that is true leaves, of its torque s_a, what the model and its rival b cannot make
between them, lambda = min_x |s_a - X x|^2 over the noise, on the new log alone and as a diagnosis sees it:
under its low-pass, with standstill left out. The log of the likelihood ratio is then normal with mean
lambda / 2 and variance lambda. A set holds one name where it and the log of the odds that a diagnosis
of the old logs gave exceed log 9. And that it is named at all, lambda against nothing must stand above
what the best of all candidates makes of noise. What is promised of a pair is the mean over which of the
two is true, by these odds.

Source: White 1980 (H^-1 S H^-1); Atkinson & Fedorov 1975 (T-optimality); Wald 1943.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy.special import ndtr, ndtri

from ..estimate import Fit
from ..inertia import DIVERGENCES
from ..linearised import Linearised
from ..motion import Motion
from ..objective import add_blocks
from ..posed_problem import known_bodies
from ..prior_weight import weakest
from .information import own_size
from .likely_prior import likeliest
from .noise import size_of
from .spectrum import Noise, noise_left, scatter, stretches
from .suspects import Seen, Suspect, solved

_ODDS = np.log(9.0)  # a set at 90 % holds one of two
_ACCUSED = 0.01  # family-wise: how often a diagnosis accuses anything where nothing is there


@dataclass(frozen=True)
class Pair:
    """Two suspects, `effect:joint`, and the probability that the logs will tell them apart: in the mean
    over which of them is true, where it is a and where it is b."""

    a: str
    b: str
    probability: float
    if_a: float
    if_b: float


def pairs(
    fit: Fit,
    suspects: Sequence[Suspect],
    new: Motion,
    samples: float,
    asked: int,
    chances: Mapping[str, float] = MappingProxyType({}),
) -> list[Pair]:
    """How likely it is that of each two suspects the one that is true will be named by a new log, and
    told from the other by all logs: in the mean over which of them that is.

    Args:
        new: the new log's motion, as a diagnosis sees it; samples: of it. asked: candidates that a
            diagnosis questions. chances: how likely one of the old logs found each suspect, `effect:joint`;
            two of which it does not say both are as likely as each other.
    """
    seen = Seen.of(fit, new, samples)
    weigh = lambda columns: (columns * seen.weights[:, None, None]).reshape(-1, columns.shape[2])  # noqa: E731
    base = weigh(seen.rows.columns)
    own = [weigh(seen.columns(one)) for one in suspects]
    sure = known_bodies(fit.experiment, fit.model)
    prior = own_size(fit.model, fit.prior, fit.x, size_of(fit), sure)
    named = [
        _named(_left(base, prior, a @ one.size, a[:, :0]), asked) for a, one in zip(own, suspects)
    ]
    words = [one.named(fit.joints) for one in suspects]
    out = []
    for i, a in enumerate(words):
        for j, b in enumerate(words[:i]):
            one, other = (chances[a], chances[b]) if {a, b} <= chances.keys() else (0.5, 0.5)
            told, each = 0.0, []
            # whichever of them is true
            for k, m, odds in ((j, i, other / one), (i, j, one / other)):
                left = _left(base, prior, own[k] @ suspects[k].size, own[m])
                each.append(float(min(_apart(left, odds), named[k])))
                told += odds / (1.0 + odds) * each[-1]
            out.append(Pair(b, a, float(told), *each))
    return out


def _left(base, prior, signature, rival) -> float:
    """lambda: what of a signature (n,) neither the model's columns (n, size), under a prior, nor a
    rival's (n, k) make."""
    beside = np.concatenate([base, rival], axis=1)
    gram = beside.T @ beside
    gram[: len(prior), : len(prior)] += prior
    cross = beside.T @ signature
    return max(float(signature @ signature - cross @ solved(gram, cross[:, None])[:, 0]), 0.0)


def _apart(left: float, odds: float) -> float:
    """The probability that a set will hold one of two that had these odds."""
    more = 0.5 * left + np.log(odds) - _ODDS
    return float(ndtr(more / np.sqrt(left))) if left > 0.0 else float(more > 0.0)


def _named(left: float, asked: int) -> float:
    """The probability that one of so many candidates stands above what noise makes of the best."""
    return float(ndtr(np.sqrt(left) + ndtri(_ACCUSED / max(asked, 1))))


@dataclass(frozen=True)
class Heard:
    """Where noise is heard: the motion of all logs, also of those that a fit does not use; what the fit
    leaves of them, left (n, dof) [N m or N], zero where a row does not count; made (n, dof,
    draws): what the angles' noise, drawn again, adds to their torque."""

    motion: Motion
    left: np.ndarray
    made: np.ndarray


def deviations(fit: Fit, old: Motion, new: Motion, heard: Heard) -> dict[str, dict]:
    """{parameter: {now, after, unit}} of what a fit determines, shape values too: the deviation that noise and
    the prior's width make of a fit of the old logs, and of the old ones and the new one together.

    Args:
        old, new: motions of the logs of the fit and of the one to come, filtered as the fit filters.
    """
    model = Linearised(fit.model, fit.x)
    std = np.concatenate([fit.uncertainty.std, fit.shape_std[model.free]])
    names = (*fit.model.names, *(fit.model.shape_values[k].name for k in model.free))
    units = (*fit.model.units, *(fit.model.shape_values[k].unit for k in model.free))
    free, count = np.isfinite(std), len(std)
    weights = np.ones(len(fit.joints)) if fit.weights is None else fit.weights
    beside, (variance, claim) = _beside(fit, count), _claim(fit, weights)
    held = np.zeros((count, count)) if fit.known is None else _of_bodies(0.5 * fit.known, count)
    noises = _noises(fit, model, heard, beside / (variance * claim) + held)

    honest = beside / claim * _nearness(fit, variance)

    def deviation(hessian, noise, free):
        inverse = _inverse(hessian + honest + held, free)
        spread = np.diagonal(inverse @ (noise + variance * honest) @ inverse)
        return np.sqrt(np.maximum(spread, 0.0))

    (own, first), (more, then) = (
        _told(model, motion, weights, noises, count) for motion in (old, new)
    )
    # what the poor log's noise held at a bound the next fit may set free
    later, coefficients = free.copy(), slice(10 * fit.model.bodies, fit.model.size)
    later[coefficients] |= np.diagonal(own + more)[coefficients] > 0.0
    now, after = deviation(own, first, free), deviation(own + more, first + then, later)
    kept = np.flatnonzero(free)
    told = {k: {"now": float(now[k]), "after": float(after[k])} for k in kept}
    return {names[k]: {**own, "unit": units[k]} for k, own in told.items()}


def _told(model, motion: Motion, weights, noises, size: int) -> tuple[np.ndarray, np.ndarray]:
    """C'C and the covariance of C'e, both (size, size), of a motion's rows that count, each joint's with
    its weight."""
    gram, spread = np.zeros((2, size, size))
    for part in stretches(model, motion):
        at, weight = np.ix_(part.support, part.support), weights[part.joint]
        gram[at] += weight**2 * part.columns @ part.columns.T
        spread[at] += weight**4 * scatter(part, noises[part.joint])
    return gram, spread


def _noises(fit: Fit, model, heard: Heard, claimed) -> list[Noise]:
    """The noise of each joint.

    Where joints are not as loud as each other, the noise of one bends what another leaves; and a strong
    prior bends what all leave. So it is told of what a fit leaves in which each joint counts by its
    own noise and the prior by what it claims to know (size, size); and of all logs, as nearly all
    of one poor log's slow noise goes into parameters. No bound holds any of these: what one log's noise
    held at its bound, another log misses.
    """
    free = np.ones(len(claimed), dtype=bool)
    left, even = heard.left, _over(fit.predictions["train"].errors()["rms"])
    gram, pull = np.array(claimed), np.zeros(len(free))
    for part in stretches(model, heard.motion):
        rows = even[part.joint] ** 2 * part.columns
        gram[np.ix_(part.support, part.support)] += rows @ part.columns.T
        pull[part.support] += rows @ left[part.rows, part.joint]
    inverse = _inverse(gram, free)

    def takes(part, seen):
        at = np.ix_(part.support, part.support)
        return even[part.joint] ** 2 * np.einsum("am,am->m", seen.conj(), inverse[at] @ seen).real

    return noise_left(stretches(model, heard.motion), left, inverse @ pull, heard.made, takes)


def _over(size) -> np.ndarray:
    """One over each (n,), zero where it is zero."""
    return np.divide(1.0, size, out=np.zeros(len(size)), where=np.asarray(size) > 0.0)


def _beside(fit: Fit, size: int) -> np.ndarray:
    """(size, size) what the prior adds to C'C: half its Hessian."""
    if not (weight := fit.experiment.prior.weight):
        return np.zeros((size, size))
    divergence = DIVERGENCES[fit.experiment.prior.divergence](fit.prior)
    return _of_bodies(0.5 * weight * np.asarray(divergence.hessian(fit.pi)), size)


def _of_bodies(blocks, size: int) -> np.ndarray:
    """(size, size) of what is told of bodies (bodies, 10, 10)."""
    return add_blocks(np.zeros((size, size)), blocks)


def _claim(fit: Fit, weights) -> tuple[float, float]:
    """The variance of what a fit left, and the weight of its prior over that of one that claims no
    more than it knows, or one (`sysid.uncertainty`)."""
    told = fit.predictions["train"]
    variance = float(np.sum((told.residual * weights) ** 2) / max(int(told.counts.sum()), 1))
    relative = DIVERGENCES[fit.experiment.prior.divergence](fit.prior).relative
    least = weakest(variance) if relative else np.inf
    share = fit.experiment.prior.weight / least if least > 0.0 else 1.0
    return max(variance, 1e-300), max(1.0, share)


def _nearness(fit: Fit, variance: float) -> float:
    """The weight of the prior that the next fit is expected to choose, over that of one that claims the
    least; one where it is given."""
    relative = DIVERGENCES[fit.experiment.prior.divergence](fit.prior).relative
    if not (fit.strength.auto and relative):
        return 1.0
    least = weakest(variance)
    return likeliest(fit, _over(fit.predictions["train"].errors()["rms"]), variance, least) / least


def _inverse(gram, free) -> np.ndarray:
    """The inverse (size, size) over the parameters that are free, zero elsewhere."""
    own = gram[np.ix_(free, free)]
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(own), 1e-300))
    out = np.zeros_like(gram)
    inverse = np.linalg.pinv(own * np.outer(scale, scale), rcond=1e-13, hermitian=True)
    out[np.ix_(free, free)] = inverse * np.outer(scale, scale)
    return out
