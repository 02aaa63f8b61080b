"""Functions of the motion of which a law may be made that nobody thought of."""

from __future__ import annotations

import numpy as np

_KNOTS, _PAIRS, _WAVES = (
    8,
    6,
    12,
)  # of a spline; of variables drawn with; random cosines of each pair
DIRECTION = "direction"  # of the joint's motion, among the variables that a function is of
_MEMORIES = (0.05, 0.2, 0.5, 1.0)  # s


def groups(
    known: dict[str, np.ndarray], joint: str, piece, step: float, rng
) -> dict[str, np.ndarray]:
    """Functions (n, k) of all that moves a joint under "*", and of each variable alone under its
    name.

    Args:
        known: {q_joint, qd_joint, qdd_joint, load_joint of every joint, time: (n,)}. piece: (n,).
    """
    parts = {name: _splines(name, values) for name, values in known.items()}
    speed = known[f"qd_{joint}"]
    direction = np.sign(speed)[:, None]
    features = [parts[f"{kind}_{joint}"] for kind in ("q", "qd", "load", "qdd")] + [parts["time"]]
    features += [direction * parts[name] for name in (f"q_{joint}", f"load_{joint}", "time")]
    features += [speed[:, None] * parts[name] for name in (f"q_{joint}", "time")]
    features += [
        known[f"qdd_{joint}"][:, None] * parts[f"q_{joint}"],
        remembered([speed, direction[:, 0]], piece, step),
    ]
    for other in (name[2:] for name in known if name.startswith("q_") and name[2:] != joint):
        features += [
            parts[f"q_{other}"],
            parts[f"qd_{other}"][:, ::2],
            parts[f"qdd_{other}"][:, ::4],
        ]
        features += [direction * parts[f"q_{other}"], np.sign(known[f"qd_{other}"])[:, None]]
        features += [
            known[f"{kind}_{joint}"][:, None] * parts[f"q_{other}"] for kind in ("q", "qd")
        ]
    features += [_waves(known, joint, rng)]
    out = {"*": np.concatenate(features, axis=1)}
    for name in known:
        if not name.startswith(("load_", "qdd_")):
            out[name] = _both_ways(parts[name], direction)
    return out


def of_unit_size(values: np.ndarray, use) -> tuple[np.ndarray, np.ndarray]:
    """Functions (n, k) at rows that count (n,), zero at others, each with a mean square of one; and
    which they are, without those that say nothing there."""
    kept, which, size = that_say_something(values, use)
    return kept / size, which


def that_say_something(values: np.ndarray, use) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of functions (n, k) those that are no constant at rows that count (n,), zero at others; which
    they are, and the root of the mean square of each."""
    kept = values if use.all() else np.where(use[:, None], values, 0.0)
    square = np.einsum("nk,nk->k", kept, kept) / len(kept)
    which = np.flatnonzero(square - kept.mean(0) ** 2 > 1e-12 * square)
    kept = kept if len(which) == len(square) else kept[:, which]
    return kept, which, np.sqrt(square[which])


def _both_ways(values: np.ndarray, direction: np.ndarray) -> np.ndarray:
    return np.concatenate([values, direction * values], axis=1)


def _splines(name: str, values: np.ndarray) -> np.ndarray:
    """Linear splines (n, knots) of one variable, knots where its values are; of a speed also its
    sign, size and slow ranges."""
    knots = np.unique(np.quantile(values, np.linspace(0.0, 1.0, _KNOTS)))
    if len(knots) < 3:
        return np.zeros((len(values), 0))
    out = np.stack([np.interp(values, knots, own) for own in np.eye(len(knots))], axis=1)
    if name.startswith("qd_"):
        size, sign = np.abs(values) / max(np.sqrt(np.mean(values**2)), 1e-12), np.sign(values)
        more = [
            sign,
            size,
            sign * size**2,
            *(sign * np.exp(-size / slow) for slow in (0.05, 0.2, 0.7)),
        ]
        out = np.column_stack([out, *more])
    return out


def remembered(signals, piece, step: float) -> np.ndarray:
    """Signals (n,) each as they were a while ago (n, signals x memories), by first-order lags
    within each piece."""
    kernels = [np.exp(-np.arange(0.0, 5.0 * span, step) / span) for span in _MEMORIES]
    late = lambda own, kernel: np.convolve(own, kernel / kernel.sum())[: len(own)]  # noqa: E731
    return np.column_stack([by_piece(piece, late, s, k) for s in signals for k in kernels])


def by_piece(piece, law, values: np.ndarray, *how) -> np.ndarray:
    """A law (..., n) of signals (..., n), of each piece (n,), ascending, by itself."""
    cuts = np.flatnonzero(np.diff(piece)) + 1
    return np.concatenate([law(own, *how) for own in np.split(values, cuts, axis=-1)], axis=-1)


def _waves(known: dict, own: str, rng: np.random.Generator) -> np.ndarray:
    """Random cosines of pairs of variables, the joint's own angle or speed in each."""
    names = [n for n in known if not n.startswith("load")]
    pairs = [(f"q_{own}", f"qd_{own}")] + [
        ((f"q_{own}", f"qd_{own}")[int(rng.integers(2))], names[int(rng.integers(len(names)))])
        for _ in range(_PAIRS - 1)
    ]
    out = []
    for first, second in pairs:
        waves = _cosines(known, first, second, _WAVES, rng)
        out += [waves, waves[:, ::2] * np.sign(known[f"qd_{own}"])[:, None]]
    return np.concatenate(out, axis=1)


def _cosines(known: dict, first: str, second: str, count: int, rng) -> np.ndarray:
    """Random cosines (n, count) of two variables, from slow to fast over their ranges."""
    x = np.stack([known[first], known[second]], axis=1)
    x = (x - x.mean(0)) / np.maximum(x.std(0), 1e-12)
    w = rng.normal(size=(2, count)) * rng.choice([0.7, 1.5, 3.0], count)
    return np.cos(x @ w + rng.uniform(0.0, 2.0 * np.pi, count))
