"""Steps of an angle between two samples that no motion makes.

A sample that was taken a little early or late, by all joints or by one that has a clock of its own,
puts its angle beside where it was: the speed from sample to sample is off once, and before and after
it is as it was. A filter makes of that step an acceleration, and the model of it a torque that
nobody measured. What is an instant of the speed alone is told as a spike of it is, less than a
sample's way; that the step stays is told by the angle, which is smooth about it without. Of samples
more than 5 ms apart nothing is told: between two of them a joint may start and stop.

Where a sample is late each time by as much, the clocks drift apart between, so that nothing is off
for long: what was taken out comes back, slower than any motion.
"""

from __future__ import annotations

import numpy as np

from .frequencies import low
from .outliers import SHORT, quantum, spikes
from .smoother import smoothed

_PASSES = 3  # over the speed: without its largest spikes those beside them stand out
_LONGEST = 2  # intervals: an acceleration that jumps makes a pulse of three
_MOST = 0.75  # of a sample's way: no clock jumps by more than a sample
_BESIDE, _STAYS = 3, 0.5  # samples; of the greatest of steps that near, what they add up to
SLOWEST = 5e-3  # s from sample to sample: in more a joint may start and stop (stick-slip, play)
_GRAINS = 3.0  # steps of the encoder: two of them are rounding's
_SMOOTH, _ORDER = 10, 3  # samples to either side, in which a motion is a polynomial of that order
# Of the square of what is not smooth about a step. White noise of 42 samples loses so much by one
# number more once in 10^12 times; a jump of acceleration loses up to half, as if it were a step
_LEFT = 0.4
_SLOW = 1.0  # Hz


def without_slips(q: np.ndarray, step: float) -> tuple[np.ndarray, list[list[tuple[int, int]]]]:
    """Angles (n, dof) of samples `step` [s] apart without their steps, and of each joint the first
    and the last sample before which its angle steps; the angles themselves where none does."""
    found, steps = _found(q, step)
    if not any(found):
        return q, found
    offset = np.concatenate([np.zeros((1, q.shape[1])), np.cumsum(steps, axis=0)])
    return q - (offset - low(offset, _SLOW, step)), found


def _found(q: np.ndarray, step: float) -> tuple[list[list[tuple[int, int]]], np.ndarray]:
    """Where each joint's angle steps, as of `without_slips`, and by how much (n - 1, dof) after each
    sample."""
    speed, found = np.diff(q, axis=0), [[] for _ in q.T]
    if step > SLOWEST or len(q) <= SHORT:
        return found, np.zeros_like(speed)
    calm, grain = speed.copy(), [quantum(own) for own in q.T]
    for _ in range(_PASSES):
        more = spikes(calm - _smooth(calm))
        for j, own in enumerate(more):
            for first, last in own:
                inside = slice(first, last + 1)
                along = np.arange(first, last + 1)
                ends = [first - 1, last + 1]
                line = np.interp(along, ends, calm[ends, j])
                far = np.abs(calm[inside, j] - line).max()
                part = _GRAINS * grain[j] < far <= _MOST * np.abs(line).max()
                if last - first < _LONGEST and part:
                    found[j].append((first, last))
                    calm[inside, j] = line
        if not any(more):
            break
    steps = speed - calm
    for j, own in enumerate(found):
        found[j] = _lasting(q[:, j], steps[:, j], _staying(steps[:, j], sorted(own)))
    return [[(a + 1, b + 1) for a, b in own] for own in found], steps


def _staying(steps: np.ndarray, found: list) -> list[tuple[int, int]]:
    """The places without those next to each other that take each other back, as of one late sample
    or of a value that was written twice; their steps (n - 1,) are put to zero."""
    apart = [k for k in range(1, len(found)) if found[k][0] - found[k - 1][1] > _BESIDE]
    out = []
    for first, last in zip([0, *apart], [*apart, len(found)]) if found else ():
        own = found[first:last]
        inside = steps[own[0][0] : own[-1][1] + 1]
        if abs(inside.sum()) > _STAYS * np.abs(inside).max():
            out += own
        else:
            inside[:] = 0.0
    return out


def _lasting(q: np.ndarray, steps: np.ndarray, found: list) -> list[tuple[int, int]]:
    """Those of the places at which an angle (n,) steps, without which it is smooth, all others being
    taken out; of the rest the steps (n - 1,) are put to zero."""
    while found:
        left, kept = q - np.concatenate([[0.0], np.cumsum(steps)]), []
        for first, last in found:
            about = slice(max(0, first - 2 * _SMOOTH), last + 2 * _SMOOTH + 2)
            own = np.zeros(len(q[about]))
            inside = slice(first - about.start, last + 1 - about.start)
            own[1:][inside] = steps[first : last + 1]
            after, before = _rough(left[about]), _rough(left[about] + np.cumsum(own))
            if after < _LEFT * before:
                kept.append((first, last))
            else:
                steps[first : last + 1] = 0.0
        if len(kept) == len(found):
            break
        found = kept
    return found


def _rough(q: np.ndarray) -> float:
    """The square of what smooth motion does not have of an angle (n,)."""
    return float(np.sum((q - _smooth(q)) ** 2))


def _smooth(values: np.ndarray) -> np.ndarray:
    """What smooth motion has of values (n, ...)."""
    return smoothed(values.T, _SMOOTH, _ORDER).T
