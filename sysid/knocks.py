"""Knocks: bursts on several joints at once of what no smooth motion with steps explains."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter

from .outliers import CHANCE, FEWEST, NOTHING, RESTING, quantum, ratio, runs, surprise

_BURST = 0.05  # s: a knock's time
_NEARBY = 0.3  # s to either side whose median level a burst must exceed: a knock rings for less
_FINEST = 1e-5  # share of an angle's spread that no encoder tells
# z75 - z50 of white noise in the shortest window, from 200 000 samples: 0.27 in 7, 0.08 in 51
_WHITE = 0.27


def knocks(q, tau, step: float) -> list[tuple[int, int, list[int]]]:
    """First and last sample, and joints, of knocks in angles and torque (n, dof), `step` [s] apart.

    The level of what is unexplained in windows of `_BURST`, over the usual: the larger of the log's
    own while the joint moves, of what is about it, and of the quantum. A knock is where it
    surprises on two joints, be it in angle or torque, or half as much on most of four or more;
    where there is one joint, in both.
    """
    n, dof = tau.shape
    length = max(FEWEST, 2 * round(0.5 * _BURST / step) + 1)
    if n < 8 * length:
        return []
    # at its ends a log is seen from one side only
    first = np.arange(length, n - 2 * length, length // 2)
    travel = np.abs(q[first + length] - q[first])
    moves = travel > RESTING * np.sqrt(np.mean(travel**2, axis=0))
    near = 2 * round(_NEARBY / (step * (length // 2))) + 1
    angle, torque = (
        np.array([_bursts(x[:, j], first, length, near, moves[:, j], nothing) for j in range(dof)])
        for x, nothing in ((q, _FINEST), (tau, NOTHING))
    )  # (dof, windows)
    own = np.maximum(angle, torque)
    level = np.log(len(first) * dof / CHANCE)
    ranked = np.sort(own, axis=0)
    both = np.minimum(angle, torque)[0] if dof == 1 else ranked[-2]
    if dof > 3:
        # of most joints at once half of it is enough: were but two of them independent
        both = np.maximum(both, 2.0 * ranked[-(dof // 2 + 1)])
    found = []
    # a knock rings: it lasts as long as windows are unusual at all, on half the evidence
    for a, b in runs(both > 0.5 * level):
        if both[a : b + 1].max() > level:
            members = np.flatnonzero(own[:, a : b + 1].max(axis=1) > 0.5 * level)
            found.append((int(first[a]), int(first[b]) + length - 1, members.tolist()))
    return found


def _bursts(values, first, length: int, near: int, moves, nothing: float) -> np.ndarray:
    """Surprise (windows,) of what is unexplained in windows of `length` samples from `first`."""
    total = np.concatenate([[0.0], np.cumsum(unexplained(values, length) ** 2)])
    level = np.sqrt(np.maximum(total[first + length] - total[first], 0.0) / length)
    usual = np.median(level[moves]) if moves.any() else np.median(level)
    about = median_filter(level, min(near, len(level)), mode="nearest")
    least = max(usual, quantum(values), nothing * np.std(values))
    scale = np.maximum(about, least)
    return surprise(ratio(level, scale), _WHITE)


def unexplained(values, length: int) -> np.ndarray:
    """What parabolas through `length` samples about, before or after each leave of values (n,).

    The least of the three. The parabola about it follows any smooth motion, those to one side do
    not see a step beyond it: neither fast motion nor a jump of friction or of acceleration leaves
    much, but a pulse or ringing as short as the window does.
    """
    out = np.full(len(values), np.inf)
    for at in (0, length // 2, length - 1):
        u = (np.arange(length) - at) / length
        weights = -np.linalg.pinv(np.vander(u, 3, increasing=True))[0]
        weights[at] += 1.0
        rest = np.abs(np.convolve(values, weights[::-1], "valid"))
        out[at : at + len(rest)] = np.minimum(out[at : at + len(rest)], rest)
    return out
