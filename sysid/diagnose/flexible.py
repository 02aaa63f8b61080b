"""The unknown as a candidate: what a flexible function of the motion takes of a joint's residual, whatever its law.

Linear splines over the joint's angle, speed and time, the same of every other joint, products and signs, what the load and the
speed were a while ago, and random cosines of pairs of variables; all together one group, held small by a ridge that blocks
held apart choose. It competes with the effects by the same gain on blocks that it was not fitted on.

Source: Rahimi & Recht 2007 (random features); Hoerl & Kennard 1970 (ridge).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import blocks

_ALL = "*"
_KNOTS, _PAIRS, _WAVES = 8, 6, 12  # of a spline; of variables drawn with; random cosines of each pair
_MEMORIES = (0.05, 0.2, 0.5, 1.0)  # s
_APART = 0.15  # s, several memories of the filters: what is predicted, and what it is predicted from
TONE = 1e-4  # probability of a line that strong by chance
_RIDGES = np.geomspace(1e-3, 30.0, 10)


@dataclass(frozen=True)
class Unknown:
    """What a flexible function takes of a joint: gain (folds,) of the weighted squared residual; told (n,) the torque that it
    predicts of folds that it was not fitted on, weighted; shares {variable: share of the squared residual that functions
    of it alone, and of the direction of motion, predict}; total: the squared residual; chance: the probability of predictions
    as good as these, were nothing there; tone: the share of a steady tone, zero where there is none."""

    gain: np.ndarray
    told: np.ndarray
    shares: dict[str, float]
    total: float
    chance: float = 1.0
    tone: float = 0.0

    @property
    def share(self) -> float:
        """Of the squared residual: what functions of the motion predict, or a tone holds, whichever is more."""
        return max(float(self.gain.sum() / self.total), self.tone)


def unknown(known: dict[str, np.ndarray], joint: str, residual, use, fold, piece, step: float, rng: np.random.Generator) -> Unknown:
    """What a flexible function of the motion takes of a joint's residual, over folds that it was not fitted on.

    Args:
        known: {q_joint, qd_joint, qdd_joint, load_joint of every joint, time: (n,)}. residual: (n,), zero where `use` (n,) is not set.
        fold: (n,) number of each row's fold. piece: (n,) of its piece, ascending.
    """
    parts = {name: _functions(name, values) for name, values in known.items()}
    speed = known[f"qd_{joint}"]
    direction = np.sign(speed)[:, None]
    features = [parts[f"{kind}_{joint}"] for kind in ("q", "qd", "load", "qdd")] + [parts["time"]]
    features += [direction * parts[name] for name in (f"q_{joint}", f"load_{joint}", "time")]
    features += [speed[:, None] * parts[name] for name in (f"q_{joint}", "time")]
    features += [known[f"qdd_{joint}"][:, None] * parts[f"q_{joint}"], _remembered(speed, direction[:, 0], piece, step)]
    for other in (name[2:] for name in known if name.startswith("q_") and name[2:] != joint):
        features += [parts[f"q_{other}"], parts[f"qd_{other}"][:, ::2], parts[f"qdd_{other}"][:, ::4]]
        features += [direction * parts[f"q_{other}"], np.sign(known[f"qd_{other}"])[:, None]]
        features += [known[f"{kind}_{joint}"][:, None] * parts[f"q_{other}"] for kind in ("q", "qd")]
    features += [_waves(known, joint, rng)]
    spans = _spans(fold, known["time"], piece)
    tried = {_ALL: _predicted(np.concatenate(features, axis=1), residual, use, spans)}
    for name in known:
        if not name.startswith(("load_", "qdd_")):
            values = np.concatenate([parts[name], direction * parts[name]], axis=1)
            tried[name] = _predicted(values, residual, use, spans)
    best = max(tried, key=lambda name: tried[name][1].sum())
    told, gain = tried[best]
    memory = blocks.memory((residual - told)[:, None], use[:, None], piece, step)
    number = blocks.numbered(known["time"], piece, memory=memory)
    # as many questions as groups of functions
    chance = min(1.0, len(tried) * min(blocks.slope_chance(one, residual, number) for one, _ in tried.values()))
    total = max(float(np.sum(residual**2)), 1e-300)
    shares = {name: float(one[1].sum() / total) for name, one in tried.items() if name != _ALL}
    share, by_chance = _tone(residual, step)
    if by_chance < TONE:
        shares["a steady tone"] = share
    return Unknown(gain, told, shares, total, chance, tone=share if by_chance < TONE else 0.0)


def _spans(fold, t, piece) -> list[tuple[np.ndarray, np.ndarray]]:
    """For each fold its rows, and these with all that stand within a while of them: what noise remembers must not tell what is
    left out (Racine 2000)."""
    apart = min(_APART, np.ptp(t) / 40.0)
    out = []
    for f in range(fold.max() + 1):
        own = np.flatnonzero(fold == f)
        near = np.zeros(len(fold), dtype=bool)
        for stretch in np.split(own, np.flatnonzero(np.diff(own) > 1) + 1):
            here = piece == piece[stretch[0]]
            near |= here & (t >= t[stretch[0]] - apart) & (t <= t[stretch[-1]] + apart)
        out.append((own, np.flatnonzero(near)))
    return out


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


def _tone(residual, step: float) -> tuple[float, float]:
    """The share of a residual's square that its strongest line holds, and the probability of such a line above the spectrum about
    it, were it noise of any smooth colour (Fisher 1929, against a local median)."""
    from scipy.ndimage import median_filter

    n = len(residual)
    power = np.abs(np.fft.rfft(residual * np.hanning(n))) ** 2
    width = max(9, int(2.0 * n * step) | 1)  # two hertz
    level = median_filter(power, width) / np.log(2.0)
    ratio = np.where(np.arange(len(power)) > n * step, power / np.maximum(level, 1e-300), 0.0)  # slower than 1 Hz is drift
    at = int(np.argmax(ratio))
    near = slice(max(0, at - 2), at + 3)
    return float(power[near].sum() / max(power.sum(), 1e-300)), float(min(1.0, len(power) * np.exp(-min(ratio[at], 700.0))))


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


def _predicted(features, y, use, spans) -> tuple[np.ndarray, np.ndarray]:
    """What ridge regression predicts (n,) of the rows of each fold from rows apart from it, and its gain (folds,)."""
    kept = np.where(use[:, None], features, 0.0)
    kept = kept[:, kept.std(0) > 1e-9]
    if not kept.shape[1]:
        return np.zeros(len(y)), np.zeros(len(spans))
    scaled = kept / np.sqrt(np.mean(kept**2, axis=0))
    system, right = scaled.T @ scaled, scaled.T @ y
    # the ridge of a fold is the one that serves the other folds best
    gains, all_told = np.zeros((len(_RIDGES), len(spans))), np.zeros((len(_RIDGES), len(y)))
    for f, (rows, near) in enumerate(spans):
        values, vectors = np.linalg.eigh(system - scaled[near].T @ scaled[near])
        turned, seen = vectors.T @ (right - scaled[near].T @ y[near]), scaled[rows] @ vectors
        for i, ridge in enumerate(_RIDGES):
            told = seen @ (turned / (np.clip(values, 0.0, None) + ridge * len(y) / len(_RIDGES)))
            all_told[i, rows] = told
            gains[i, f] = np.sum(2.0 * told * y[rows] - told**2)
    chosen = [int(np.argmax(gains.sum(1) - gains[:, f])) for f in range(len(spans))]
    told = np.zeros(len(y))
    for i, (rows, _) in zip(chosen, spans):
        told[rows] = all_told[i, rows]
    return told, np.array([gains[i, f] for f, i in enumerate(chosen)])
