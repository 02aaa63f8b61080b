"""Below and above a frequency."""

from __future__ import annotations

import math

import numpy as np

_FEWEST = 20  # samples worth filtering


def low(values: np.ndarray, cutoff: float, step: float) -> np.ndarray:
    """Values (n, ...) below a cutoff [Hz], neither shifted nor bent at the ends: a Butterworth
    filter of order 4 forth and back, by its response, as scipy.signal alone takes longer to import
    than a log to filter."""
    if cutoff * step >= 0.45 or len(values) < _FEWEST:
        return values
    beyond = min(math.ceil(3.0 / (cutoff * step)), len(values) - 1)  # beyond its memory
    before = 2.0 * values[:1] - values[beyond:0:-1]
    after = 2.0 * values[-1:] - values[-2 : -beyond - 2 : -1]
    padded = np.concatenate([before, values, after])
    # the straight line between its ends passes as it is, and without it they join
    along = np.linspace(0.0, 1.0, len(padded)).reshape(-1, *[1] * (values.ndim - 1))
    line = padded[:1] + along * (padded[-1:] - padded[:1])
    frequency = np.minimum(np.fft.rfftfreq(len(padded)), 0.499)
    ratio = np.tan(np.pi * frequency) / math.tan(math.pi * cutoff * step)
    gain = (1.0 / (1.0 + ratio**8)).reshape(-1, *[1] * (values.ndim - 1))
    bent = gain * np.fft.rfft(padded - line, axis=0)
    filtered = line + np.fft.irfft(bent, len(padded), axis=0)
    return filtered[beyond : beyond + len(values)]
