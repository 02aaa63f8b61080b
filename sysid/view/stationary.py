"""What noise of one spectrum, the same all the time, would make of columns' scores."""

from __future__ import annotations

import numpy as np

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
    size = _smooth(n + lags)
    square = lambda x: np.abs(np.fft.rfft(x, size, axis=0)) ** 2  # noqa: E731
    pairs = np.fft.irfft(square(use.astype(float)), size, axis=0)
    lag = np.minimum(np.arange(size), size - np.arange(size))
    window = np.clip(1.0 - lag / (lags + 1.0), 0.0, None)[:, None]
    weight = np.where(pairs > 0.5, window / np.maximum(pairs, 0.5), 0.0)

    def smoothed(power):
        alike = np.fft.irfft(power, size, axis=0) * weight
        return np.clip(np.fft.rfft(alike, axis=0).real, 0.0, None).T

    taken = [square(own * u[:, None]).sum(axis=1) for own, u in zip(columns, use.T)]
    left = 1.0 - smoothed(np.stack(taken, axis=1))
    return smoothed(square(np.where(use, values, 0.0))) / np.maximum(left, _LEAST)


def _smooth(least: int) -> int:
    """The least even number that is not below another and has no prime factors above five, as fast
    Fourier transforms want it: `scipy.fft.next_fast_len`, whose import takes as long as they do."""
    odds = [3**b * 5**c for b in range(21) for c in range(14) if 3**b * 5**c <= 2 * least]
    return min(odd << max(1, (-(-least // odd) - 1).bit_length()) for odd in odds)


def drawn(spectrum, n: int, draws: int, rng: np.random.Generator) -> np.ndarray:
    """Normal noise (n, draws) of a power spectrum as `spectra` tells it; in single precision."""
    size = 2 * (len(spectrum) - 1)
    white = np.fft.rfft(rng.normal(size=(size, draws)).astype(np.float32), axis=0)
    white *= np.sqrt(spectrum).astype(np.float32)[:, None]
    return np.fft.irfft(white, size, axis=0)[:n].astype(np.float32)


def covariance(columns, spectrum) -> np.ndarray:
    """Covariance (..., k, k) of the scores of columns (..., k, n), zero where rows do not count.

    In single precision: it says how sure something is."""
    size = 2 * (len(spectrum) - 1)
    most = np.maximum(np.abs(columns).max(axis=-1, keepdims=True), 1e-300)
    turned = np.fft.rfft((columns / most).astype(np.float32), size, axis=-1)
    turned = np.ascontiguousarray(turned, dtype=np.complex64)  # NumPy 1 transforms in double
    weight = spectrum / size * np.where(np.arange(len(spectrum)) % (size // 2), 2.0, 1.0)
    turned *= np.sqrt(weight).astype(np.float32)
    both = turned.view(np.float32)  # real and imaginary parts side by side
    return (both @ np.swapaxes(both, -1, -2)).astype(float) * most * np.swapaxes(most, -1, -2)
