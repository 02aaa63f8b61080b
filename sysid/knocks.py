"""Knocks: bursts on several joints at once of what no smooth motion with steps explains."""

from __future__ import annotations

import numpy as np

from .outliers import BURST, CHANCE, FEWEST, NOTHING, RESTING, bursts, quantum, ratio, surprise
from .running import running

_NEARBY = 0.3  # s to either side whose median level a burst must exceed: a knock rings for less
_FINEST = 1e-5  # share of an angle's spread that no encoder tells
# z75 - z50 of white noise in the shortest window, from 200 000 samples: 0.27 in 7, 0.08 in 51
_WHITE = 0.27
# the same of what most of seven joints show; and by how much steeper its tail is than from there on,
# from 120 logs of white and coloured noise, in 9600 windows of each of which the greatest is 5.0
_WHITE_MOST, _TAIL_MOST = 0.24, 1.8


def knocks(q, tau, step: float, *, spiked=None, among: int = 1) -> list[tuple[int, int, list[int]]]:
    """First and last sample, and joints, of knocks in angles and torque (n, dof), `step` [s] apart.

    The level of what is unexplained in windows of `BURST`, over the usual: the larger of the log's
    own while the joint moves, of what is about it, and of the quantum. A knock is where it
    surprises on two joints, be it in angle or torque, or where most of four or more show it in
    both; where there is one joint, in both.

    Args:
        spiked: the torque with its spikes, which `tau` is without: what comes on most joints at
            once is none. None: it has none. among: as of `spikes`.
    """
    n, dof = tau.shape
    length = max(FEWEST, 2 * round(0.5 * BURST / step) + 1)
    if n < 8 * length:
        return []
    # at its ends a log is seen from one side only
    first = np.arange(length, n - 2 * length, length // 2)
    travel = np.abs(q[first + length] - q[first])
    moves = travel > RESTING * np.sqrt(np.mean(travel**2, axis=0))
    near = 2 * round(_NEARBY / (step * (length // 2))) + 1
    told = lambda x, nothing: np.array(  # noqa: E731 - (dof, windows)
        [_bursts(x[:, j], first, length, near, moves[:, j], nothing) for j in range(dof)]
    )
    angle, torque = told(q, _FINEST), told(tau, NOTHING)
    whole = torque if spiked is None or spiked is tau else told(spiked, NOTHING)
    own = np.maximum(angle, torque)
    level = np.log(len(first) * dof * among / CHANCE)
    both = np.minimum(angle, torque)[0] if dof == 1 else np.sort(own, axis=0)[-2]
    if dof > 3:
        both = np.maximum(both, _most(angle, whole) + np.log(dof))  # whose level has no joints in it
    found = []
    for a, b in bursts(both, level):  # a knock rings
        greatest = own[:, a : b + 1].max(axis=1)
        members = np.flatnonzero(greatest > min(0.5 * level, np.median(greatest)))
        found.append((int(first[a]), int(first[b]) + length - 1, members.tolist()))
    return found


def _most(angle, torque) -> np.ndarray:
    """Surprise (windows,) of the least of what most joints' angles and most joints' torques show.

    In both, for stamps that jitter stand in all angles alike; and among its own values, for joints
    are not independent.
    """
    rank = len(angle) // 2 + 1
    least = np.minimum(*(np.sort(values, axis=0)[-rank] for values in (angle, torque)))
    return surprise(least, _WHITE_MOST, tail=_TAIL_MOST)


def _bursts(values, first, length: int, near: int, moves, nothing: float) -> np.ndarray:
    """Surprise (windows,) of what is unexplained in windows of `length` samples from `first`."""
    total = np.concatenate([[0.0], np.cumsum(unexplained(values, length) ** 2)])
    level = np.sqrt(np.maximum(total[first + length] - total[first], 0.0) / length)
    usual = np.median(level[moves]) if moves.any() else np.median(level)
    about = running(level, min(near, len(level)), "median", "edge")
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
