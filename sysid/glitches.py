"""Samples of an angle that stand alone, as an encoder or its wire makes them: a filter makes of one a
knock that the arm never had, so that what was about it is put in its place.
"""

from __future__ import annotations

import numpy as np

from .outliers import NORMAL, SHORT, SPIKE, quantum, spikes
from .running import running

_NOISES = 4.0  # deviations of the angle's noise, of which a step is usual
# Of how far a joint goes: what makes no torque to speak of; and of how far the farthest goes, who stands
_HARMLESS, _STANDS = 1e-4, 1e-3
_BESIDE, _ORDER = 6, 3  # samples to either side, between which the motion is a polynomial
_FARTHER = 3.0  # times from the curve than any sample beside it
_NEAR = 24  # samples to either side among which these are
_FELT = 3  # samples to either side of which a logger's own derivative is made


def without_glitches(q: np.ndarray) -> tuple[np.ndarray, list[list[tuple[int, int]]]]:
    """Angles (n, dof) without samples that stand alone, and of each joint the first and the last of
    such; the angles themselves where there is none.

    As of a torque's `spikes`, of what an angle has beside the running median: of one that goes on
    either way this is nothing, so that neither fast motion nor a sample that was taken late is any.
    """
    if len(q) < SHORT:
        return q, [[] for _ in q.T]
    middle = np.stack([running(own, 4 * SPIKE + 1, "median", "edge") for own in q.T], axis=1)
    # where an angle turns round it stands beside its median by its noise and its steps; what is no
    # more than the tails of a noisy encoder does no harm
    noise = np.median(np.abs(np.diff(q, 2, axis=0)), axis=0) / (NORMAL * np.sqrt(6.0))
    # of a joint that stands for most of a log these are nothing, and a resampled angle's ripple is more
    least = _HARMLESS * np.ptp(middle, axis=0)
    grain = np.maximum(np.maximum(_NOISES * noise, least), [quantum(own) for own in q.T])
    grain[least <= _STANDS * least.max()] = np.inf
    found = spikes(q - middle, grain=grain)
    if not any(found):
        return q, found
    out, rows, told = q.copy(), np.arange(len(q)), [list[tuple[int, int]]() for _ in q.T]
    for j, own in enumerate(found):
        good = np.ones(len(q), dtype=bool)
        for first, last in own:
            good[first : last + 1] = False
        for first, last in own:
            near = rows[max(first - _NEAR, 0) : last + _NEAR + 1]
            near = near[good[near]]
            about = np.concatenate([near[near < first][-_BESIDE:], near[near > last][:_BESIDE]])
            alone, order = np.arange(first, last + 1), min(_ORDER, len(about) - 1)
            curve = np.polynomial.Polynomial.fit(about, q[about, j], order)
            # where a motion sets off none of its samples is on the curve
            beside, far = (np.abs(q[at, j] - curve(at)).max() for at in (about, alone))
            if far > _FARTHER * beside:
                out[alone, j] = curve(alone)
                told[j].append((first, last))
    return out, told


def without_their_slopes(
    values: np.ndarray | None, found: list[list[tuple[int, int]]]
) -> np.ndarray | None:
    """Logged speeds or accelerations (n, dof) with straight lines where they were made of samples
    that stand alone; None where none were logged."""
    if values is None or not any(found):
        return values
    out, rows = values.copy(), np.arange(len(values))
    for j, own in enumerate(found):
        good = np.ones(len(values), dtype=bool)
        for first, last in own:
            good[max(first - _FELT, 0) : last + _FELT + 1] = False
        if good.any() and not good.all():
            out[~good, j] = np.interp(rows[~good], rows[good], values[good, j])
    return out
