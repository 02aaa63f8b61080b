"""A low-pass that neither shifts nor rings and forgets soon."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

_WIDTH = 4.0  # standard deviations of the kernel that are kept
_FEWEST = 8  # windows of one product
HIGHEST = 0.3  # of the sampling rate: the last cutoff at which the kernel still has a shape


def _weighed(seen, weights, stride: int) -> np.ndarray:
    """Sums (..., n) of every `stride`-th window of values (..., m) under weights (k,).

    Several windows that overlap are one product with a band of weights, at a matrix library's
    speed: a quarter more of values than one window has, of short windows up to twice as many, as
    a product with fewer than eight columns is not worth its call.
    """
    size = len(weights)
    count = (seen.shape[-1] - size) // stride + 1
    many = max(size // (4 * stride), min(_FEWEST, 1 + size // stride))
    out = np.empty(seen.shape[:-1] + (count,))
    whole, view = count // many, np.lib.stride_tricks.sliding_window_view
    if whole:
        band = np.zeros((size + (many - 1) * stride, many))
        for k in range(many):
            band[k * stride : k * stride + size, k] = weights
        blocks = view(seen, len(band), axis=-1)[..., :: many * stride, :][..., :whole, :]
        out[..., : whole * many] = (blocks @ band).reshape(*seen.shape[:-1], whole * many)
    if count > whole * many:
        rest = view(seen[..., whole * many * stride :], size, axis=-1)[..., ::stride, :]
        out[..., whole * many :] = rest[..., : count - whole * many, :] @ weights
    return out


class Gaussian:
    """A zero-phase low-pass with a Gaussian kernel: -3 dB at the cutoff, no ringing, a finite
    memory of `reach` samples. `every`: of how many samples it leaves one worth keeping."""

    kind = "gaussian"

    def __init__(self, cutoff: float, step: float, every: int = 1):
        sigma = math.sqrt(math.log(2.0)) / (
            2.0 * math.pi * cutoff * step
        )  # samples: |H| = exp(-(2 pi f sigma)^2 / 2)
        self.cutoff, self.step, self.every = cutoff, step, every
        self.reach = math.ceil(_WIDTH * sigma)
        weights = np.exp(-0.5 * (np.arange(-self.reach, self.reach + 1) / sigma) ** 2)
        self.weights = weights / weights.sum()

    @property
    def taken_of_noise(self) -> float:
        """The share of white noise's root mean square that it takes away."""
        rest = -self.weights
        rest[self.reach] += 1.0
        return float(np.sqrt(np.sum(rest**2)))

    def at(self, values, rows: slice) -> np.ndarray:
        """The filtered values (..., n) at some rows of the last axis; the edge's value goes on
        beyond the edge."""
        n, stride = values.shape[-1], rows.step or 1
        kept = range(*rows.indices(n))
        if not len(kept):
            return np.zeros(values.shape[:-1] + (0,))
        first, last = kept[0] - self.reach, kept[-1] + self.reach
        seen = values[..., max(first, 0) : last + 1]
        if first < 0 or last >= n:
            beyond = [(0, 0)] * (values.ndim - 1) + [(max(-first, 0), max(last - n + 1, 0))]
            seen = np.pad(seen, beyond, mode="edge")
        return _weighed(seen, self.weights, stride)

    def each(self, runs: Sequence[np.ndarray], rows: Sequence[slice]) -> np.ndarray:
        """`at` of several runs (..., n), one after the other: as one, since a product with few
        columns is not worth its call. The stride of all is the same."""
        stride, size = rows[0].step or 1, len(self.weights)
        kept = [range(*own.indices(run.shape[-1])) for run, own in zip(runs, rows)]
        counts = np.array([len(own) for own in kept])
        # each starts at a whole number of strides, a window that lies in two is asked by nobody
        places = -(-((counts - 1) * stride + size) // stride)
        starts = np.concatenate([[0], np.cumsum(places)])
        joined = np.zeros((*runs[0].shape[:-1], starts[-1] * stride))
        for run, own, start in zip(runs, kept, starts * stride):
            if not len(own):
                continue
            first, last = own[0] - self.reach, own[-1] + self.reach + 1
            seen = run[..., max(first, 0) : last]
            before, end = start + max(-first, 0), start + last - first
            after = before + seen.shape[-1]
            joined[..., before:after] = seen
            joined[..., start:before] = seen[..., :1]
            joined[..., after:end] = seen[..., -1:]
        found = _weighed(joined, self.weights, stride)
        wanted = [np.arange(start, start + own) for start, own in zip(starts, counts)]
        return found[..., np.concatenate(wanted)]

    def __call__(self, values, axis: int = -1) -> np.ndarray:
        """The filtered values, same shape."""
        return np.moveaxis(self.at(np.moveaxis(values, axis, -1), slice(None)), -1, axis)
