"""What noise of one spectrum, the same all the time, would make of columns' scores."""

from __future__ import annotations

import numpy as np
from scipy import fft  # of many columns at once, in single precision ten times NumPy's speed

_MEMORIES = 16.0  # of the noise: the window takes a sixteenth of what is slow, of first order
_LEAST = 0.1  # share that a fit may have left: what it took more of says little of the noise


def spectra(values, columns, use, memory: float, step: float) -> np.ndarray:
    """Power spectra (k, frequencies) of the noise that a fit has left values (n, k) of, as the
    transform of their correlation up to sixteen memories (Blackman & Tukey 1958, Bartlett's window),
    over the share that the fit has left of white noise there: of slow noise a model takes more.

    Args:
        columns: (k, n, p) orthonormal, of the fit. use: (n, k) bool, rows that count. memory: [s].
        step: from row to row [s].
    """
    n = len(values)
    lags = min(n - 1, max(1, int(_MEMORIES * memory / step)))
    size = 2 * fft.next_fast_len((n + lags + 1) // 2, real=True)  # even
    square = lambda x: np.abs(fft.rfft(x, size, axis=0)) ** 2  # noqa: E731
    pairs = fft.irfft(square(use.astype(float)), size, axis=0)
    lag = np.minimum(np.arange(size), size - np.arange(size))
    window = np.clip(1.0 - lag / (lags + 1.0), 0.0, None)[:, None]
    weight = np.where(pairs > 0.5, window / np.maximum(pairs, 0.5), 0.0)

    def smoothed(power):
        alike = fft.irfft(power, size, axis=0) * weight
        return np.clip(fft.rfft(alike, axis=0).real, 0.0, None).T

    taken = [square(own * u[:, None]).sum(axis=1) for own, u in zip(columns, use.T)]
    left = 1.0 - smoothed(np.stack(taken, axis=1))
    return smoothed(square(np.where(use, values, 0.0))) / np.maximum(left, _LEAST)


def drawn(spectrum, n: int, draws: int, rng: np.random.Generator) -> np.ndarray:
    """Normal noise (n, draws) of a power spectrum as `spectra` tells it; in single precision."""
    size = 2 * (len(spectrum) - 1)
    white = fft.rfft(rng.normal(size=(size, draws)).astype(np.float32), axis=0)
    white *= np.sqrt(spectrum).astype(np.float32)[:, None]
    return fft.irfft(white, size, axis=0)[:n].astype(np.float32)


def covariance(columns, spectrum) -> np.ndarray:
    """Covariance (..., k, k) of the scores of columns (..., k, n), zero where rows do not count.

    In single precision: it says how sure something is."""
    size = 2 * (len(spectrum) - 1)
    most = np.maximum(np.abs(columns).max(axis=-1, keepdims=True), 1e-300)
    turned = fft.rfft((columns / most).astype(np.float32), size, axis=-1)
    weight = spectrum / size * np.where(np.arange(len(spectrum)) % (size // 2), 2.0, 1.0)
    turned *= np.sqrt(weight).astype(np.float32)
    both = turned.view(np.float32)  # real and imaginary parts side by side
    return (both @ np.swapaxes(both, -1, -2)).astype(float) * most * np.swapaxes(most, -1, -2)
