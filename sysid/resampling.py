"""Signals of uneven stamps at even ones, as noisy as they were."""

from __future__ import annotations

import numpy as np

#: steps of the usual length from one sample to the next, between which one is missing
MISSING = 1.5
_APART = 0.75  # of a step: samples further apart than this tell a slope


def resampled(t, signals, step: float, *, linear: bool = False) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """An even clock (m,) [s], and signals there.

    Args:
        t: (n,) [s], ascending. signals: {name: values (n, ...)}. step: of the clock [s].
        linear: torque is the mean of both neighbours, as all else that is noisy is.
    """
    from scipy.interpolate import make_interp_spline

    clock = t[0] + step * np.arange(int(np.floor((t[-1] - t[0]) / step + 1e-9)) + 1)
    out = {}
    for name, values in signals.items():
        if name == "tau" and len(t) > 2 and not linear:
            out[name] = moved(t, values, clock, step)
            continue
        # angles are smooth, the rest carries noise that a cubic would overshoot on
        order = 3 if name in ("q", "qd") and len(t) > 3 else 1
        out[name] = make_interp_spline(t, values, k=order, axis=0)(clock)
    return clock, out


def moved(t, torque, clock, step: float) -> np.ndarray:
    """Torque (n, dof) at a `clock` (m,) [s]: what was measured nearest, moved by the slope about it.

    So it is as noisy as it was logged, in every row: the mean of both neighbours loses a third of the
    variance of white noise on average, and half of it midway. The slope is the median of those to
    samples on both sides and of that across five, so that a spike stays in its row; of samples that
    came close together it would be noise. Where samples are missing it is that mean.
    """
    after = np.clip(np.searchsorted(t, clock), 1, len(t) - 1)
    nearest = np.where(clock - t[after - 1] < t[after] - clock, after - 1, after)
    at = t[nearest]
    left, right = (_beside(t, at, way * _APART * step) for way in (-1.0, 1.0))
    further = [_beside(t, at, way * (1.0 + _APART) * step) for way in (-1.0, 1.0)]
    slopes = [_slope(t, torque, *ends) for ends in ((left, nearest), (nearest, right), further)]
    moved = torque[nearest] + np.median(slopes, axis=0) * (clock - at)[:, None]
    width = (t[after] - t[after - 1])[:, None]
    part = (clock - t[after - 1])[:, None] / width
    mean = (1.0 - part) * torque[after - 1] + part * torque[after]
    return np.where(width > MISSING * step, mean, moved)


def _beside(t, at, away: float) -> np.ndarray:
    """The nearest sample that is so far `away` [s] from each time, or the last one that way."""
    if away < 0.0:
        return np.maximum(np.searchsorted(t, at + away, "right") - 1, 0)
    return np.minimum(np.searchsorted(t, at + away), len(t) - 1)


def _slope(t, values, first, last) -> np.ndarray:
    """Slope (n, ...) between samples; of one and itself none."""
    apart = t[last] - t[first]
    return (values[last] - values[first]) / np.where(apart > 0.0, apart, np.inf)[:, None]
