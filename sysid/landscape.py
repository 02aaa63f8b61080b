"""The objective over the shape values of one effect on one joint, everything linear solved for each
set of them.

About a model that is settled, with the prior's Hessian P there, all that is linear answers a change
u of one joint's torque, in units of 1/sqrt(2 w^2), by -H^-1 A'u, so that the objective changes by
-r'u + M(u, u)/2 with

    M(u, v) = u'v - (B'u)'(B'v),        H = A'A + P,  BB' = A H^-1 A',  r the residual.

What a joint's effect makes, C(s) c, is such a change against what it makes now; the best c for each
s is least squares under M (variable projection; Golub & Pereyra 1973), and hundreds of sets s are
asked for in one product of matrices.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import eigen
from . import rows as row
from .effect import NotFinite, SensorEffect
from .projection import inverted, prior_hessian

_SPACE = 4_000_000  # numbers in one batch of columns
_VISIBLE = 1e-9  # of a column's square, what rounding leaves of one that all else makes
_FLAT = 1e-9  # of the greatest singular value, in columns as long as one each
_STEPS = 30


@dataclass(frozen=True)
class Landscape:
    """The objective over an effect's free shape values, relative to where the model stands.

    names, low, high, least (K,): of the values that are not held; here (K,) where they stand.
    `make(values (B, K))` gives the effect's columns (n, B, k) in the units above, not finite where
    it has none. positive (k,): which coefficients must not be negative. basis (n, r): B. target
    (n,): what C(s) c is held against. zero: what the effect makes now is worth.
    """

    names: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    least: np.ndarray
    here: np.ndarray
    make: Callable[[np.ndarray], np.ndarray]
    positive: np.ndarray
    basis: np.ndarray
    target: np.ndarray
    zero: float
    objective: float

    def gains(self, values: np.ndarray) -> np.ndarray:
        """What the objective falls by (B,) at sets of values (B, K); minus infinity where an effect
        is no number or would have to be negative."""
        size = max(1, _SPACE // (len(self.target) * max(1, len(self.positive))))
        parts = [values[start : start + size] for start in range(0, len(values), size)]
        return np.concatenate([self._gains(self.make(own)) for own in parts] or [np.zeros(0)])

    def _gains(self, made: np.ndarray) -> np.ndarray:
        finite, unit = _unit(made)
        system, right = self._reduced(unit)
        sizes, axes = eigen.symmetric(system)
        seen = sizes > _VISIBLE
        along = np.einsum("bij,bi->bj", axes, right)
        c = np.einsum("bij,bj->bi", axes, along * seen / np.where(seen, sizes, 1.0))
        gain = 0.5 * np.einsum("bi,bi->b", c, right) - self.zero
        return np.where(finite & ~(c[:, self.positive] < 0).any(1), gain, -np.inf)

    def _reduced(self, made: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Normal equations (B, k, k) and (B, k) of columns (n, B, k)."""
        n, count, k = made.shape
        absorbed = (self.basis.T @ made.reshape(n, count * k)).reshape(-1, count, k)
        square = lambda x: np.einsum("nbi,nbj->bij", x, x)  # noqa: E731
        return square(made) - square(absorbed), np.einsum("nbi,n->bi", made, self.target)

    def slopes(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Normal equations (K, K) and (K,) of the values about a place (K,), all that is linear
        solved for; None where it is no number."""
        step = 1e-4 * np.maximum(np.abs(at), self.least)
        step = np.where(at + step <= self.high, step, -step)
        made = self.make(np.vstack([at, at + np.diag(step)]))
        if not np.isfinite(made).all():
            return None
        own, k = made[:, :1], made.shape[2]
        (system,), (right,) = self._reduced(own)
        bent = ((made[:, 1:] - own) @ (inverted(system) @ right)) / step
        (system,), (right,) = self._reduced(np.concatenate([own, bent[:, None]], axis=2))
        cross = system[k:, :k]
        back = inverted(system[:k, :k]) @ np.column_stack([cross.T, right[:k]])
        return system[k:, k:] - cross @ back[:, :-1], right[k:] - cross @ back[:, -1]

    def descended(
        self, at: np.ndarray, *, free=None, steps: int = _STEPS, tolerance: float = 1e-10
    ) -> tuple[np.ndarray, float]:
        """Values and gain after damped Gauss-Newton steps from a place, within the bounds.

        Args:
            free: (K,) bool, which values may move; all of them by default.
        """
        free = np.ones(len(at), dtype=bool) if free is None else free
        gain, damping = float(self.gains(at[None])[0]), 1e-3
        for _ in range(steps if np.isfinite(gain) else 0):
            if (normal := self.slopes(at)) is None:
                break
            system, right = normal
            inside = free & ~((at <= self.low) & (right < 0) | (at >= self.high) & (right > 0))
            if not inside.any():
                break
            system, right = system[np.ix_(inside, inside)], right[inside]
            diagonal = np.where(np.diagonal(system) > 0, np.diagonal(system), 1.0)
            before = gain
            for _ in range(8):
                step = np.zeros(len(at))
                step[inside] = inverted(system + damping * np.diag(diagonal)) @ right
                tried = np.clip(at + step, self.low, self.high)
                found = float(self.gains(tried[None])[0])
                if found > gain:
                    at, gain, damping = tried, found, max(0.1 * damping, 1e-9)
                    break
                damping *= 10.0
            if not gain - before > tolerance * self.objective:
                break
        return at, gain

    def stepped(
        self, at: np.ndarray, reach: np.ndarray, *, halvings: int = 12
    ) -> tuple[np.ndarray, float]:
        """Values and gain after steps along each value in turn, halved where none gains: for what
        has corners and jumps.

        Args:
            reach: (K,) the first step.
        """
        gain, reach = float(self.gains(at[None])[0]), np.array(reach, dtype=float)
        for _ in range(4 * halvings):
            tried = np.clip(at + np.vstack([np.diag(reach), -np.diag(reach)]), self.low, self.high)
            gains = self.gains(tried)
            best = int(np.argmax(gains))
            if gains[best] > gain:
                at, gain = tried[best], float(gains[best])
            elif (halvings := halvings - 1) < 0:
                break
            else:
                reach *= 0.5
        return at, gain


def _unit(made: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which sets (B,) are finite, and their columns (n, B, k) as long as one each, zero where they
    are not."""
    size = np.max(np.abs(made), axis=0)
    finite = np.isfinite(size)
    made = np.where(finite, made, 0.0) / np.where(finite & (size > 0), size, 1.0)
    norm = np.sqrt(np.einsum("nbi,nbi->bi", made, made))
    return finite.all(1), made / np.where(norm > 0, norm, 1.0)


def landscape(
    found, motion, term: int, joint: int, weights, *, rows: int | None = None, pinned: bool = True
) -> Landscape:
    """The landscape of a torque effect of a model that is settled.

    Args:
        found: a `settled.Settled`. weights: (joints,) or None.
        rows: on so many of the rows, drawn from all.
        pinned: what stands at its bound of zero stays there; otherwise it answers as if it had no
            bound.
    """
    model, effect = found.model, found.model.terms[term][0]
    values = [v for v in model.shape_values if (v.term, v.joint) == (term, joint)]
    free, at = [v for v in values if not v.held], model.shapes_of(term, joint)
    kept = np.arange(len(found.rows.t))
    if rows is not None and rows < len(kept):
        kept = np.sort(np.random.default_rng(0).permutation(kept)[:rows])
    scale = np.ones(model.robot.dof) if weights is None else np.asarray(weights, dtype=float)
    scale = np.sqrt(2.0 * len(found.rows.t) / len(kept)) * scale
    count = 10 * model.bodies
    linear = [(c.term, c.joint) == (term, joint) for c in model.coefficients]
    own = count + np.flatnonzero(linear)
    # what is held, or stands at its bound of zero, does not answer
    still = [*np.flatnonzero(found.problem.coordinates.held), *(at_zero(found) if pinned else ())]
    rest = np.setdiff1d(np.arange(model.size), [*own, *(count + k for k in still)])
    residual = scale * found.rows.residual(found.x)[kept]
    columns = lambda j, which: scale[j] * found.rows.columns[j][np.ix_(kept, which)]  # noqa: E731
    if len(kept) < len(found.rows.t):
        data = [columns(j, rest) for j in range(len(scale))]
    else:  # all of them stand in a triangle, and that known bodies are known as well: once or twice
        data = [np.sqrt(2.0) * found.problem.objective.triangle[:, rest]]
    half = _half_inverse(data, prior_hessian(found)[np.ix_(rest, rest)])
    basis = columns(joint, rest) @ half
    # a coefficient at its bound is at no stationary point: it would move by itself
    linear_ones = rest[rest >= count]
    pull = sum(columns(j, linear_ones).T @ own for j, own in enumerate(residual.T))
    pull = half[rest >= count].T @ pull
    now = columns(joint, own) @ found.x[own]
    left = now - basis @ (basis.T @ now)
    target = residual[:, joint] - basis @ pull + left
    names = tuple(v.shape.name for v in free)
    make = _maker(found, motion, effect, joint, names, at, kept)
    return Landscape(
        names, *(np.array([getattr(v, end) for v in free]) for end in ("low", "high")),
        np.array([v.shape.least or 1e-2 * (v.high - v.low) for v in free]),
        np.array([at[name] for name in names]), lambda values: scale[joint] * make(values),
        np.array([c.lower == 0 for c in effect.coefficients()], dtype=bool), basis, target,
        float(now @ target - 0.5 * now @ left - 0.5 * pull @ pull), found.objective,
    )  # fmt: skip


def _half_inverse(columns: list[np.ndarray], prior: np.ndarray) -> np.ndarray:
    """G (size, r) with GG' = (A'A + P)^-1 on its range, of columns A in parts (n, size): from
    singular values, as those of A'A would lose half the digits."""
    sizes, axes = eigen.symmetric(prior)
    root = (axes * np.sqrt(np.clip(sizes, 0.0, None))).T
    stacked = np.concatenate([*columns, root])
    norm = np.linalg.norm(stacked, axis=0)
    norm = np.where(norm > 0.0, norm, 1.0)
    triangle = np.linalg.qr(stacked / norm, mode="r")
    _, sizes, axes = np.linalg.svd(triangle, full_matrices=False)
    kept = sizes > _FLAT * sizes[:1]
    return (axes[kept].T / sizes[kept]) / norm[:, None]


def at_zero(found) -> list[int]:
    """The coefficients that a solution holds at their bound of zero, of those that may move."""
    return [
        k for k in found.problem.certify(found.x).at_zero if not found.problem.coordinates.held[k]
    ]


def _maker(
    found, motion, effect, joint: int, names, others: dict, kept
) -> Callable[[np.ndarray], np.ndarray]:
    """The effect's columns (n, B, k) on the rows `kept` (n,) for sets of values (B, K)."""
    model, use, stride = found.model, found.rows.use, found.stride
    pieces = row.seen(model, motion)
    sensed = any(isinstance(other, SensorEffect) for other, _ in model.terms)
    filtered = any(piece.smoother is not None for piece in motion.pieces)
    plain = not (effect.memory or effect.reach or sensed or filtered)
    if plain:  # row by row: only those that count are needed
        at = [found.rows.index[kept][found.rows.piece[kept] == k] for k in range(len(pieces))]
        pieces = [piece.part(mine) for piece, mine in zip(pieces, at) if len(mine)]
    counts = use[kept, joint][:, None]

    def columns(at: np.ndarray) -> np.ndarray:
        shapes = {**others, **dict(zip(names, map(float, at)))}
        try:
            with np.errstate(all="ignore"):
                if plain:
                    parts = [effect.columns(piece, joint, **shapes) for piece in pieces]
                    return np.concatenate(parts, axis=1).T * counts
                made = row.signature(model, motion, pieces, effect, joint, shapes, stride, use)
                return made[kept]
        except NotFinite:
            return np.full((len(kept), len(effect.coefficients())), np.nan)

    return lambda values: np.stack([columns(at) for at in values], axis=1)
