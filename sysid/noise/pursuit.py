"""What plain functions of the motion explain of a residual is taken off it."""

import math

import numpy as np

from .motion_functions import Kinematics, functions, motion_of, ripples
from .stretches import Run

# Functions are fitted at this many samples per period of the bandwidth, and taken where they
# explain this many times the mean square of what is left.
_FUNCTION_RATE, _GAIN = 40.0, 12.0
_TINY = 1e-300


class Functions:
    """Functions of the motion of one joint that a residual is asked for."""

    def __init__(self, runs: list[Run], at: Kinematics, predicted, joint: int, bandwidth: float):
        """`predicted` (n,) torque of each run [N m or N]."""
        self.runs, self.joint, self.rows = runs, joint, at.rows
        seconds = sum(len(run.q) * run.step for run in runs)
        self.most = int(0.5 * bandwidth * seconds)  # leaves three quarters of the band's freedom
        # noise far above the band would hide what is in it
        self.thin = [max(1, int(1.0 / (r.step * _FUNCTION_RATE * bandwidth))) for r in runs]
        self.motion = motion_of(runs, at, predicted, joint, self.thin)
        centres = [
            rows.start + m // 2 + m * np.arange(len(run.q) // m)
            for rows, m, run in zip(at.rows, self.thin, runs)
        ]
        self.coarse = self.motion.every(np.concatenate(centres))

    def removed_from(self, values: list[np.ndarray], kept: list[np.ndarray]):
        """The residual (n,) of each run without what functions of the motion explain, how many they
        were, the power they took.

        One after the other (orthogonal matching pursuit), each while it explains more than noise
        would let it.
        """
        count = sum(int(k.sum()) for k in kept)
        mean = sum(float(v[k].sum()) for v, k in zip(values, kept)) / max(count, 1)
        y = [v - mean for v in values]
        if self.most < 1:
            return y, 0, 0.0
        block = lambda v, m: v[: len(v) // m * m].reshape(-1, m).mean(1)  # noqa: E731
        weight = np.concatenate([block(k.astype(float), m) for k, m in zip(kept, self.thin)])
        target = np.concatenate([block(v * k, m) for v, k, m in zip(y, kept, self.thin)])
        target /= np.maximum(weight, _TINY)
        own = (x[:, self.joint] for x in (self.coarse.q, self.coarse.v))
        waves = ripples(*own, target * weight)
        root = np.sqrt(weight)
        x = root * [f() for f in functions(self.coarse, self.joint, *waves)]
        norm = np.sqrt(np.mean(x**2, axis=1)) + _TINY
        chosen, weights = _pursuit((x / norm[:, None]).T, root * target, self.most)
        if not chosen:
            return y, 0, 0.0
        every = functions(self.motion, self.joint, *waves)
        taken = sum(w / norm[k] * every[k]() for k, w in zip(chosen, weights))
        power = float(np.var(taken[np.concatenate(kept)]))
        return [v - taken[rows] for v, rows in zip(y, self.rows)], len(chosen), power


def _pursuit(x: np.ndarray, target: np.ndarray, most: int) -> tuple[list[int], np.ndarray]:
    """Columns of x (n, k) and their weights, taken while the best explains more than noise
    would."""
    gram, product, left = x.T @ x, x.T @ target, float(target @ target)
    chosen: list[int] = []
    # what of each function is free of the chosen ones, and what it would take
    free, pull = gram.copy(), product.copy()
    while len(chosen) < most:
        size = np.diag(free)
        gain = np.where(size > 1e-6 * len(x), pull**2 / np.maximum(size, _TINY), 0.0)
        k = int(np.argmax(gain))
        if gain[k] <= max(_GAIN * left / len(x), 0.0):  # what rounding leaves may be less than none
            break
        left -= gain[k]
        column = free[:, k] / math.sqrt(size[k])
        pull = pull - column * pull[k] / math.sqrt(size[k])
        free = free - np.outer(column, column)
        chosen.append(k)
    return chosen, np.linalg.solve(gram[np.ix_(chosen, chosen)], product[chosen])
