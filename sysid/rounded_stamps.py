"""Stamps of a steady clock that were rounded, told from stamps that jitter."""

from __future__ import annotations

import numpy as np

# Steps that all stay this close to the median are uniform sampling with rounded time stamps.
UNIFORM = 0.02
# Of what stamps are rounded to: as much beside a line is a steady clock's own rounding. Twice that is most likely a steady one's
# too, which ran late now and then, unless the angles tell otherwise.
ROUNDED = 0.505


def off_steady(t, step: float) -> float:
    """By how much stamps (n,) are off a steady clock, in what they are rounded to: half of it of a
    clock that is steady; zero of stamps whose steps are all near `step`; infinite of stamps that
    are not rounded."""
    if np.abs(np.diff(t) - step).max() <= UNIFORM * step:
        return 0.0
    since = t - t[0]
    for digits in range(10):
        quantum = 10.0**-digits
        if quantum <= step and np.abs(since / quantum - np.round(since / quantum)).max() < 1e-3:
            return off_line(since / quantum)
    return np.inf


def off_line(values) -> float:
    """The distance within which all of values (n,) stay of the best straight line (Chebyshev's):
    one of the edges of their hull is as steep."""
    from scipy.spatial import ConvexHull, QhullError

    along = np.linspace(0.0, 1.0, len(values))
    beside = values - (values[0] + (values[-1] - values[0]) * along)
    try:
        corners = ConvexHull(np.stack([along, beside], axis=1)).vertices
    except QhullError:  # a straight line
        return float(np.abs(beside).max())
    along, beside = along[corners], beside[corners]
    with np.errstate(divide="ignore", invalid="ignore"):
        steep = (np.roll(beside, 1) - beside) / (np.roll(along, 1) - along)
    return 0.5 * min(float(np.ptp(beside - one * along)) for one in steep[np.isfinite(steep)])
