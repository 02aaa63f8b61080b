"""The objective over the shape values of one effect on one joint, everything linear solved for each
set of them.

About a model that is settled, with the prior's Hessian there, all that is linear answers a change u
of one joint's torque by -H^-1 2A'u, so that the objective changes by -2r'u + M(u, u)/2 with

    M(u, v) = 2u'v - (2A'u)' H^-1 (2A'v),        H = 2A'A + P,  r the residual.

What a joint's effect makes, C(s) c, is such a change against what it makes now; the best c for each
s is least squares under M (variable projection; Golub & Pereyra 1973), and hundreds of sets s are
asked for in one product of matrices.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import rows as row
from .effect import NotFinite, SensorEffect
from .projection import inverted, prior_hessian

_SPACE = 4_000_000  # numbers in one batch of columns
_VISIBLE = 1e-9  # of a column's square, what rounding leaves of one that all else makes
_STEPS = 30


@dataclass(frozen=True)
class Landscape:
    """The objective over an effect's free shape values, relative to where the model stands.

    names, low, high, least (K,): of the values that are not held; here (K,) where they stand.
    `make(values (B, K))` gives the effect's columns (n, B, k), not finite where it has none.
    positive (k,): which coefficients must not be negative. columns (n, rest): everything else that
    is linear, in this joint's torque; inverse (rest, rest): H^-1. target (n,): what C(s) is held
    against. zero: what it makes now is worth.
    """

    names: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    least: np.ndarray
    here: np.ndarray
    make: Callable[[np.ndarray], np.ndarray]
    positive: np.ndarray
    columns: np.ndarray
    inverse: np.ndarray
    target: np.ndarray
    weight: float
    zero: float
    objective: float

    def gains(self, values: np.ndarray) -> np.ndarray:
        """What the objective falls by (B,) at sets of values (B, K); minus infinity where an effect
        is no number or would have to be negative.
        """
        out, size = [], max(1, _SPACE // (len(self.target) * max(1, len(self.positive))))
        for start in range(0, len(values), size):
            out.append(self._gains(self.make(values[start : start + size])))
        return np.concatenate(out) if out else np.zeros(0)

    def _gains(self, made: np.ndarray) -> np.ndarray:
        n, count, k = made.shape
        finite, scale = _scaled(made)
        flat = scale.reshape(n, count * k)
        cross = 2.0 * self.weight * self.columns.T @ flat
        absorbed = (self.inverse @ cross).reshape(-1, count, k)
        system = 2.0 * self.weight * np.einsum("nbi,nbj->bij", scale, scale) - np.einsum(
            "rbi,rbj->bij", cross.reshape(-1, count, k), absorbed
        )
        right = np.einsum("nbi,n->bi", scale, self.target)
        if k == 1:
            seen = system[:, 0, 0] > _VISIBLE * 2.0 * self.weight
            c = np.where(seen, right[:, 0] / np.where(seen, system[:, 0, 0], 1.0), 0.0)[:, None]
        else:
            c = (
                np.stack([inverted(one) @ r for one, r in zip(system, right)])
                if count
                else np.zeros((0, k))
            )
        gain = 0.5 * np.einsum("bi,bi->b", c, right) - self.zero
        return np.where(finite & ~(c[:, self.positive] < 0).any(1), gain, -np.inf)

    def slopes(self, at: np.ndarray):
        """Normal equations (K, K) and (K,) of the values about a place (K,), all that is linear
        solved for; None where it is no number.
        """
        step = 1e-4 * np.maximum(np.abs(at), self.least)
        step = np.where(at + step <= self.high, step, -step)
        made = self.make(np.vstack([at, at + np.diag(step)]))
        if not np.isfinite(made).all():
            return None
        own = made[:, 0]
        m, right = self._reduced(own)
        c = inverted(m) @ right
        bent = np.einsum("nbi,i->nb", made[:, 1:] - own[:, None], c) / step
        m, right = self._reduced(np.hstack([own, bent]))
        k = own.shape[1]
        back = inverted(m[:k, :k]) @ np.column_stack([m[:k, k:], right[:k]])
        return m[k:, k:] - m[k:, :k] @ back[:, :-1], right[k:] - m[k:, :k] @ back[:, -1]

    def _reduced(self, made: np.ndarray):
        cross = 2.0 * self.weight * self.columns.T @ made
        return (
            2.0 * self.weight * made.T @ made - cross.T @ self.inverse @ cross,
            made.T @ self.target,
        )

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


def _scaled(made: np.ndarray):
    """Which sets (B,) are finite, and their columns (n, B, k) as long as one each, zero where they
    are not.
    """
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
        found: a `shape.Settled`. weights: (joints,) or None. rows: on so many of the rows, drawn
        from all.
        pinned: what stands at its bound of zero stays there; otherwise it answers as if it had no
        bound.
    """
    model, wanted, rows = found.model, rows, found.rows
    effect = model.terms[term][0]
    values = [v for v in model.shape_values if (v.term, v.joint) == (term, joint)]
    free = [v for v in values if not v.held]
    held = model.shapes_of(term, joint)
    count = 10 * model.bodies
    own = [
        count + i
        for i, c in enumerate(model.coefficients)
        if (c.effect, c.joint) == (effect.name, joint)
    ]
    # what is held, or stands at its bound of zero, does not answer
    still = np.zeros(model.size, dtype=bool)
    still[count:] = found.problem.coordinates.held
    if pinned:
        still[[count + k for k in at_zero(found)]] = True
    rest = np.setdiff1d(np.flatnonzero(~still), own)
    scale = np.ones(model.robot.dof) if weights is None else np.asarray(weights)
    kept = np.arange(len(rows.t))
    if wanted is not None and wanted < len(kept):
        kept = np.sort(np.random.default_rng(0).permutation(kept)[:wanted])
    share = len(rows.t) / len(kept)
    square = share * scale**2
    picked = rows.columns[np.ix_(range(len(scale)), kept, rest)]
    system = (
        sum(2.0 * w * a.T @ a for w, a in zip(square, picked))
        + prior_hessian(found)[np.ix_(rest, rest)]
    )
    columns, inverse, weight = picked[joint], inverted(system), float(square[joint])
    residual = rows.residual(found.x)[kept, joint]
    # a coefficient at its bound is at no stationary point: it would move by itself
    pull = np.where(
        rest >= count,
        sum(2.0 * w * a.T @ r for w, a, r in zip(square, picked, rows.residual(found.x)[kept].T)),
        0.0,
    )
    residual = residual - columns @ (inverse @ pull)
    now = rows.columns[joint][np.ix_(kept, own)] @ found.x[own]
    answered = now - columns @ (inverse @ (2.0 * weight * columns.T @ now))
    target = 2.0 * weight * (residual + answered)
    zero = float(now @ target - weight * now @ answered - 0.5 * pull @ inverse @ pull)
    names = tuple(v.shape.name for v in free)
    return Landscape(
        names, *(np.array([getattr(v, end) for v in free]) for end in ("low", "high")),
        np.array([v.shape.least or 1e-2 * (v.high - v.low) for v in free]),
        np.array([held[name] for name in names]),
        _maker(found, motion, effect, joint, names, held, kept),
        np.array([c.lower == 0 for c in effect.coefficients()], dtype=bool),
        columns, inverse, target, weight, zero, found.objective,
    )  # fmt: skip


def at_zero(found) -> list[int]:
    """The coefficients that a solution holds at their bound of zero, of those that may move."""
    return [
        k for k in found.problem.certify(found.x).at_zero if not found.problem.coordinates.held[k]
    ]


def _maker(
    found, motion, effect, joint: int, names, others: dict, kept
) -> Callable[[np.ndarray], np.ndarray]:
    """The effect's columns on the rows `kept` (n,) for sets of values (B, K)."""
    model, rows = found.model, found.rows
    pieces = row.seen(model, motion)
    use, stride = rows.use, found.stride
    sensed = any(isinstance(other, SensorEffect) for other, _ in model.terms)
    plain = not (
        effect.memory
        or effect.reach
        or sensed
        or any(p.smoother is not None for p in motion.pieces)
    )
    if plain:  # row by row: only those that count are needed
        parts = []
        for k, piece in enumerate(pieces):
            mine = rows.index[kept][rows.piece[kept] == k]
            parts.append(piece.part(mine))
        pieces, counts = parts, use[kept, joint][:, None]
    k = len(effect.coefficients())

    def columns(at) -> np.ndarray:
        shapes = {**others, **dict(zip(names, map(float, at)))}
        with np.errstate(all="ignore"):
            try:
                if plain:
                    return (
                        np.concatenate(
                            [effect.columns(p, joint, **shapes) for p in pieces if len(p.t)], axis=1
                        ).T
                        * counts
                    )
                return row.signature(model, motion, pieces, effect, joint, shapes, stride, use)[
                    kept
                ]
            except NotFinite:
                return np.full((len(kept), k), np.nan)

    return lambda values: np.stack([columns(at) for at in values], axis=1)
