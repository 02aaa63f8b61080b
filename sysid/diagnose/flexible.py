"""The unknown as a candidate: what a flexible function of the motion takes of a joint's residual, whatever its law.

Linear splines over the joint's angle, speed and time, the same of every other joint, products and signs, what the load and the
speed were a while ago, and random cosines of pairs of variables; all together one group, held small by a ridge that blocks
held apart choose. It competes with the effects by the same gain on blocks that it was not fitted on.

Source: Rahimi & Recht 2007 (random features); Hoerl & Kennard 1970 (ridge).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_KNOTS, _PAIRS, _WAVES = 8, 6, 12  # of a spline; of variables drawn with; random cosines of each pair
_MEMORIES = (0.05, 0.2, 0.5, 1.0)  # s
_RIDGES = np.geomspace(1e-3, 30.0, 10)


@dataclass(frozen=True)
class Unknown:
    """What a flexible function takes of a joint: gain (folds,) of the weighted squared residual; told (n,) the torque that it
    predicts of folds that it was not fitted on, weighted; shares {variable: share of the squared residual that functions
    of it alone, and of the direction of motion, predict}; total: the squared residual."""

    gain: np.ndarray
    told: np.ndarray
    shares: dict[str, float]
    total: float


def unknown(known: dict[str, np.ndarray], joint: str, residual, use, fold, piece, step: float, rng: np.random.Generator) -> Unknown:
    """What a flexible function of the motion takes of a joint's residual, over folds that it was not fitted on.

    Args:
        known: {q_joint, qd_joint, qdd_joint, load_joint of every joint, time: (n,)}. residual: (n,), zero where `use` (n,) is not set.
        fold, piece: (n,) numbers, ascending.
    """
    parts = {name: _functions(name, values) for name, values in known.items()}
    speed = known[f"qd_{joint}"]
    direction = np.sign(speed)[:, None]
    tones = _tones(residual, known["time"], step)
    features = [parts[f"{kind}_{joint}"] for kind in ("q", "qd", "load", "qdd")] + [parts["time"], tones]
    features += [direction * parts[name] for name in (f"q_{joint}", f"load_{joint}", "time")]
    features += [speed[:, None] * parts[name] for name in (f"q_{joint}", "time")]
    features += [known[f"qdd_{joint}"][:, None] * parts[f"q_{joint}"], _remembered(speed, direction[:, 0], piece, step)]
    for other in (name[2:] for name in known if name.startswith("q_") and name[2:] != joint):
        features += [parts[f"q_{other}"][:, ::2], parts[f"qd_{other}"][:, ::2], parts[f"qdd_{other}"][:, ::4]]
        features += [direction * parts[f"q_{other}"][:, ::2], np.sign(known[f"qd_{other}"])[:, None]]
        features += [known[f"q_{joint}"][:, None] * parts[f"q_{other}"][:, ::3]]
    features += [_waves(known, joint, rng)]
    spans = [slice(a, b) for a, b in zip(*(lambda c: (c[:-1], c[1:]))(np.searchsorted(fold, np.arange(fold.max() + 2))))]
    told, gain = _predicted(np.concatenate(features, axis=1), residual, use, spans)
    total = max(float(np.sum(residual**2)), 1e-300)
    alone = {
        name: np.concatenate([parts[name], direction * parts[name]], axis=1)
        for name in known if not name.startswith(("load_", "qdd_"))
    }  # fmt: skip
    if tones.size:
        alone["a steady tone"] = tones
    shares = {name: float(_predicted(values, residual, use, spans)[1].sum() / total) for name, values in alone.items()}
    return Unknown(gain, told, shares, total)


def _functions(name: str, values: np.ndarray) -> np.ndarray:
    """Linear splines (n, knots) of one variable, knots where its values are; of a speed also its sign, size and slow ranges."""
    knots = np.unique(np.quantile(values, np.linspace(0.0, 1.0, _KNOTS)))
    if len(knots) < 3:
        return np.zeros((len(values), 0))
    out = np.stack([np.interp(values, knots, own) for own in np.eye(len(knots))], axis=1)
    if name.startswith("qd_"):
        size, sign = np.abs(values) / max(np.sqrt(np.mean(values**2)), 1e-12), np.sign(values)
        more = [sign, size, sign * size**2, *(sign * np.exp(-size / slow) for slow in (0.05, 0.2, 0.7))]
        out = np.column_stack([out, *more])
    return out


def _tones(residual, t, step: float) -> np.ndarray:
    """Sine and cosine (n, 6) of the three strongest tones of a residual: what comes in time and not with the motion."""
    n = 1 << (2 * len(residual)).bit_length()
    power = np.abs(np.fft.rfft(residual, n)) ** 2
    power[: int(n * step)] = 0.0  # slower than one hertz is drift
    out = []
    for _ in range(3):
        at = int(np.argmax(power))
        if not power[at] > 0:
            break
        angle = 2.0 * np.pi * at / (n * step) * t
        out += [np.sin(angle), np.cos(angle)]
        power[max(0, at - 8) : at + 9] = 0.0
    return np.stack(out, axis=1) if out else np.zeros((len(t), 0))


def _remembered(speed, direction, piece, step: float) -> np.ndarray:
    """Speed and direction (n, 2 memories) as they were a while ago, by first-order lags within each piece."""
    pieces = [piece == number for number in np.unique(piece)]
    out = []
    for values in (speed, direction):
        for span in _MEMORIES:
            weights = np.exp(-np.arange(0.0, 5.0 * span, step) / span)
            late = np.zeros(len(values))
            for own in pieces:
                late[own] = np.convolve(values[own], weights / weights.sum())[: own.sum()]
            out.append(late)
    return np.column_stack(out)


def _waves(known: dict, own: str, rng: np.random.Generator) -> np.ndarray:
    """Random cosines of pairs of variables, the joint's own angle or speed in each."""
    names = [n for n in known if not n.startswith("load")]
    pairs = [(f"q_{own}", f"qd_{own}")] + [
        ((f"q_{own}", f"qd_{own}")[int(rng.integers(2))], names[int(rng.integers(len(names)))]) for _ in range(_PAIRS - 1)
    ]
    out = []
    for first, second in pairs:
        x = np.stack([known[first], known[second]], axis=1)
        x = (x - x.mean(0)) / np.maximum(x.std(0), 1e-12)
        w, phase = rng.normal(size=(2, _WAVES)) * rng.choice([0.7, 1.5, 3.0], _WAVES), rng.uniform(0.0, 2.0 * np.pi, _WAVES)
        waves = np.cos(x @ w + phase)
        out += [waves, waves[:, ::2] * np.sign(known[f"qd_{own}"])[:, None]]
    return np.concatenate(out, axis=1)


def _predicted(features, y, use, spans: list[slice]) -> tuple[np.ndarray, np.ndarray]:
    """What ridge regression predicts (n,) of the rows of each fold from the others, and its gain (folds,)."""
    kept = np.where(use[:, None], features, 0.0)
    kept = kept[:, kept.std(0) > 1e-9]
    if not kept.shape[1]:
        return np.zeros(len(y)), np.zeros(len(spans))
    scaled = kept / np.sqrt(np.mean(kept**2, axis=0))
    grams = [(scaled[s].T @ scaled[s], scaled[s].T @ y[s]) for s in spans]
    system, right = sum(g for g, _ in grams), sum(r for _, r in grams)
    # the ridge of a fold is the one that serves the other folds best
    gains, all_told = np.zeros((len(_RIDGES), len(spans))), np.zeros((len(_RIDGES), len(y)))
    for f, ((g, r), rows) in enumerate(zip(grams, spans)):
        values, vectors = np.linalg.eigh(system - g)
        turned, seen = vectors.T @ (right - r), scaled[rows] @ vectors
        for i, ridge in enumerate(_RIDGES):
            told = seen @ (turned / (np.clip(values, 0.0, None) + ridge * len(y) / len(_RIDGES)))
            all_told[i, rows] = told
            gains[i, f] = np.sum(2.0 * told * y[rows] - told**2)
    chosen = [int(np.argmax(gains.sum(1) - gains[:, f])) for f in range(len(spans))]
    told = np.concatenate([all_told[i, rows] for i, rows in zip(chosen, spans)])
    return told, np.array([gains[i, f] for f, i in enumerate(chosen)])
