"""Noise with a memory -> innovations: an autoregressive model of each joint's residual.

Residual and columns are averaged over a few milliseconds and go through the same filter, which
leaves white noise of unit variance where the residual is noise. An innovation counts where every
average that it looks at does: after a gap, noise with a memory is larger than an innovation.

    e_k = (r_k - sum_i a_i r_(k-i)) / sigma

Source: Kay 1988 (Yule-Walker equations), Akaike 1974 (the order).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_toeplitz

_LONGEST = 12  # terms: as much is lost after each gap


@dataclass(frozen=True)
class Whitening:
    """filters (dof, order + 1), the first entry 1 / sigma."""

    filters: np.ndarray

    @property
    def order(self) -> int:
        """How many earlier averages the longest filter looks at."""
        return self.filters.shape[1] - 1

    def __call__(self, values: np.ndarray, whole: np.ndarray) -> np.ndarray:
        """Innovations (dof, n - order, k) of values (dof, n, k) that begin `order` earlier.

        Args:
            whole: (dof, n) bool, averages that count.
        """
        n = values.shape[1] - self.order
        out = np.zeros((values.shape[0], n, *values.shape[2:]))
        shape = (-1, *(1,) * (values.ndim - 1))
        for lag, weights in enumerate(self.filters.T):
            if weights.any():
                first = self.order - lag
                out += weights.reshape(shape) * values[:, first : first + n]
        gaps = np.cumsum(np.pad(~whole, ((0, 0), (1, 0))), axis=1)
        counts = gaps[:, self.order + 1 :] == gaps[:, :n]
        return out * counts[:, :, None]


def whitening(residual: np.ndarray, whole: np.ndarray) -> Whitening:
    """The filters that leave white noise of unit variance of residuals (dof, n), where these count
    (dof, n)."""
    found = [_autoregressive(*own) for own in zip(residual, whole)]
    longest = max(map(len, found))
    return Whitening(np.array([np.pad(own, (0, longest - len(own))) for own in found]))


def _autoregressive(values, whole) -> np.ndarray:
    """(order + 1,) one joint's filter: the order of least information criterion."""
    n = len(values)
    size = 1 << (2 * n).bit_length()
    most = int(min(_LONGEST, n // 10))
    products, pairs = (
        np.fft.irfft(np.abs(np.fft.rfft(own, size)) ** 2)[: most + 1]
        for own in (np.where(whole, values, 0.0), whole.astype(float))
    )
    memory = products / np.maximum(pairs, 1.0)
    if memory[0] <= 0.0:
        return np.ones(1)
    best, out = np.inf, np.array([1.0 / np.sqrt(memory[0])])
    for order in range(most + 1):
        terms = solve_toeplitz(memory[:order], memory[1 : order + 1]) if order else np.zeros(0)
        variance = memory[0] - terms @ memory[1 : order + 1]
        if variance <= 1e-12 * memory[0]:
            break
        worth = n * np.log(variance) + 2.0 * order
        if worth < best:
            best, out = worth, np.append(1.0, -terms) / np.sqrt(variance)
    return out
