"""Samples of an angle that stand alone, as an encoder or its wire makes them: a filter makes of one a
knock that the arm never had, so that what was about it is put in its place.
"""

from __future__ import annotations

import numpy as np

from .outliers import NORMAL, SHORT, SPIKE, quantum, spikes
from .running import running

_NOISES = 4.0  # deviations of the angle's noise, of which a step is usual
_BESIDE, _ORDER = 6, 3  # samples to either side, between which the motion is a polynomial
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
    grain = np.maximum(_NOISES * noise, [quantum(own) for own in q.T])
    found = spikes(q - middle, grain=grain)
    if not any(found):
        return q, found
    out, rows = q.copy(), np.arange(len(q))
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
            out[alone, j] = curve(alone)
    return out, found


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
