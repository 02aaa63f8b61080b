"""Signals of uneven stamps at even ones, as noisy as they were."""

from __future__ import annotations

import numpy as np

#: steps of the usual length from one sample to the next, between which one is missing
MISSING = 1.5


def resampled(t, signals, step: float) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """An even clock (m,) [s], and signals there.

    Args:
        t: (n,) [s], ascending. signals: {name: values (n, ...)}. step: of the clock [s].
    """
    from scipy.interpolate import make_interp_spline

    clock = t[0] + step * np.arange(int(np.floor((t[-1] - t[0]) / step + 1e-9)) + 1)
    out = {}
    for name, values in signals.items():
        if name == "tau" and len(t) > 2:
            out[name] = _moved(t, values, clock, MISSING * step)
            continue
        # angles are smooth, the rest carries noise that a cubic would overshoot on
        order = 3 if name in ("q", "qd") and len(t) > 3 else 1
        out[name] = make_interp_spline(t, values, k=order, axis=0)(clock)
    return clock, out


def _moved(t, torque, clock, missing: float) -> np.ndarray:
    """Torque (n, dof) at a `clock` (m,) [s]: what was measured nearest, moved by the slope about it.

    So it is as noisy as it was logged, in every row: the mean of both neighbours loses a third of the
    variance of white noise on average, and half of it midway. The slope is the median of those to
    both neighbours and of that across five samples, so that a spike stays in its row. Between samples
    further apart than `missing` [s] it is that mean.
    """
    after = np.clip(np.searchsorted(t, clock), 1, len(t) - 1)
    nearest = np.where(clock - t[after - 1] < t[after] - clock, after - 1, after)
    inside = np.clip(nearest, 1, len(t) - 2)
    across = np.maximum(inside - 2, 0), np.minimum(inside + 2, len(t) - 1)
    slopes = [
        _slope(t, torque, *ends) for ends in ((inside - 1, inside), (inside, inside + 1), across)
    ]
    moved = torque[nearest] + np.median(slopes, axis=0) * (clock - t[nearest])[:, None]
    width = (t[after] - t[after - 1])[:, None]
    part = (clock - t[after - 1])[:, None] / width
    mean = (1.0 - part) * torque[after - 1] + part * torque[after]
    return np.where(width > missing, mean, moved)


def _slope(t, values, first, last) -> np.ndarray:
    return (values[last] - values[first]) / (t[last] - t[first])[:, None]
