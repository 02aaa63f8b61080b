"""Steps of a primal-dual method in Nesterov-Todd coordinates, in which a body and its multiplier are one diagonal matrix,
and a coefficient and its multiplier one number.

Source: Vandenberghe 2010, "The CVXOPT linear and quadratic cone program solvers"; Mehrotra 1992 (predictor-corrector).
"""

from dataclasses import dataclass

import numpy as np

from .inertia.pseudo import from_pseudo, to_pseudo
from .symmetric_matrices import BASIS, coordinates, packed, unpacked

_DIAGONAL = np.arange(4)


def scaling(factors: np.ndarray) -> np.ndarray:
    """T (bodies, 10, 10): columns are the changes of pi for unit changes F B_k F' of each body."""
    changes = factors[:, None] @ BASIS @ np.swapaxes(factors, -1, -2)[:, None]
    return np.swapaxes(from_pseudo(changes), -1, -2)


def scaled_columns(root: np.ndarray, turn: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """R T (rows, size) for the bodies' T (bodies, 10, 10) and the coefficients' scales (coefficients,)."""
    bodies, rows = len(turn), len(root)
    out = np.empty_like(root)
    blocks = np.swapaxes(root[:, : 10 * bodies].reshape(rows, bodies, 10), 0, 1) @ turn
    out[:, : 10 * bodies] = np.swapaxes(blocks, 0, 1).reshape(rows, -1)
    out[:, 10 * bodies :] = root[:, 10 * bodies :] * spread
    return out


def scaled_gradient(gradient: np.ndarray, turn: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """T' g (size,)."""
    count = 10 * len(turn)
    out = np.empty(len(gradient))
    out[:count] = (np.swapaxes(turn, -1, -2) @ gradient[:count].reshape(-1, 10, 1)).ravel()
    out[count:] = gradient[count:] * spread
    return out


@dataclass
class State:
    """Where the search stands: the parameters x (size,), the multipliers of bodies and of bounds."""

    x: np.ndarray
    z: np.ndarray  # (bodies, 4, 4)
    dual: np.ndarray  # (coefficients,), zero where a coefficient is free


@dataclass
class Scaled:
    """Nesterov-Todd: F with F^-1 J F^-T = F' Z F = diag(weights); for coefficients sqrt(c / z) and sqrt(c z)."""

    factors: np.ndarray
    inverse: np.ndarray  # F^-1
    shrink: np.ndarray  # (2 bodies, 4, 4): the same twice, 1 / sqrt(weight_i weight_j)
    weights: np.ndarray  # (bodies, 4)
    spread: np.ndarray
    root: np.ndarray


def scale(state: State, count: int, bound) -> Scaled:
    """The scaled coordinates of a state whose first `count` parameters are bodies; bound (coefficients,) bool, those that must
    not be negative. Raises numpy.linalg.LinAlgError: rounding no longer tells a body from an impossible one."""
    both = np.linalg.cholesky(np.concatenate([to_pseudo(state.x[:count].reshape(-1, 10)), state.z]))
    lower, upper = both[: len(state.z)], both[len(state.z) :]
    u, weights, vt = np.linalg.svd(np.swapaxes(upper, -1, -2) @ lower)
    root = np.sqrt(weights)
    factors = lower @ np.swapaxes(vt, -1, -2) / root[:, None, :]
    inverse = np.swapaxes(upper @ u, -1, -2) / root[:, :, None]
    c, dual = np.where(bound, state.x[count:], 1.0), np.where(bound, state.dual, 1.0)
    shrink = 1.0 / (root[:, :, None] * root[:, None, :])
    return Scaled(factors, inverse, np.concatenate([shrink, shrink]), weights, np.sqrt(c / dual), np.sqrt(c * dual))


@dataclass
class Change:
    """A step in scaled coordinates: of x, of the bodies and of their multipliers, of the coefficients' multipliers."""

    step: np.ndarray
    both: np.ndarray  # (2 bodies, 4, 4): changes of the bodies, then of their multipliers
    dual: np.ndarray

    @property
    def body(self) -> np.ndarray:
        return self.both[: len(self.both) // 2]

    @property
    def multiplier(self) -> np.ndarray:
        return self.both[len(self.both) // 2 :]


def changed(solve, slope, scaled: Scaled, aim, fixed, bound) -> Change:
    """The step that an aim, as `aimed` has it, asks for.

    Args:
        solve: of the scaled system. slope: (size,) scaled gradient of what is smooth. fixed: numbers of parameters that stay.
    """
    right = aim - slope
    right[fixed] = 0.0
    step = solve(right)
    count = 10 * len(scaled.weights)
    both = unpacked(np.concatenate([step[:count], aim[:count] - step[:count]]))
    both[len(scaled.weights) :, _DIAGONAL, _DIAGONAL] -= scaled.weights
    return Change(step, both, np.where(bound, aim[count:] - scaled.root - step[count:], 0.0))


def aimed(scaled: Scaled, bound, level_j, level_c: float, straight: Change | None, share: float = 1.0) -> np.ndarray:
    """What body plus multiplier should change by, plus the multiplier: the right side of the scaled equations.

    Complementarity asks Lambda o (dJ + dZ) = level - Lambda^2 - dJ o dZ; the last term is what the predictor
    `straight` showed the product of both changes to be, or a share of it.
    """
    bodies = packed(level_j / scaled.weights)
    c = np.where(bound, level_c / scaled.root, 0.0)
    if straight is not None:
        product = share * straight.body @ straight.multiplier
        product = product + np.swapaxes(product, -1, -2)  # twice the symmetric part
        bodies = bodies - coordinates(product / (scaled.weights[:, :, None] + scaled.weights[:, None, :])).ravel()
        c = c - share * np.where(bound, straight.step[bodies.size :] * straight.dual / scaled.root, 0.0)
    return np.concatenate([bodies, c])


def gaps(scaled: Scaled, bound, change: Change | None = None, length: float = 0.0) -> np.ndarray:
    """The complementarity (2,) of the bodies and of the coefficients, and what a step of some length leaves of it."""
    roots, own = np.where(bound, scaled.root, 0.0), np.stack([np.sum(scaled.weights**2), np.sum(scaled.root[bound] ** 2)])
    if change is None:
        return own
    step, diagonal = np.where(bound, change.step[len(change.step) - len(bound) :], 0.0), (..., _DIAGONAL, _DIAGONAL)
    first = np.sum(scaled.weights * (change.body + change.multiplier)[diagonal]), np.sum(roots * (step + change.dual))
    second = np.sum(change.body * change.multiplier), np.sum(step * change.dual)
    return own + length * np.array(first) + length**2 * np.array(second)


def reach(change: Change, scaled: Scaled, bound) -> float:
    """How far along a change the bodies and their multipliers, and the coefficients and theirs, stay positive; nowhere along one that
    is no number."""
    if not np.isfinite(change.both).all():
        return 0.0
    worst = np.linalg.eigvalsh(change.both * scaled.shrink)[:, 0].min()
    own, dual = change.step[len(change.step) - len(bound) :] / scaled.root, change.dual / scaled.root
    worst = min(worst, np.where(bound, own, 0.0).min(initial=0.0), dual.min(initial=0.0))
    return 1.0 / max(-worst, 1e-12)


def stepped(state, turn, scaled: Scaled, change: Change, length, bound, free, count) -> State:
    """The state after a part `length` of a change; turn: as `scaling` has it. free: (coefficients,) bool."""
    x = state.x.copy()
    x[:count] += length * (turn @ change.step[:count].reshape(-1, 10, 1)).ravel()
    x[count:] += np.where(free, length * scaled.spread * change.step[count:], 0.0)
    moved = length * change.multiplier
    moved[:, _DIAGONAL, _DIAGONAL] += scaled.weights
    z = np.swapaxes(scaled.inverse, -1, -2) @ moved @ scaled.inverse
    dual = np.where(bound, (scaled.root + length * change.dual) / scaled.spread, 0.0)
    return State(x, 0.5 * (z + np.swapaxes(z, -1, -2)), dual)
