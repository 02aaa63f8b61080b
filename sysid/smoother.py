"""The zero-phase filters from logged angles to position, velocity and acceleration."""

import math

import numpy as np

from .errors import ConfigError
from .specs import PreprocessSpec

# How far from a reversal this share is left of the squared error which the filter makes of a jump in acceleration: 3 % of its RMS.
_LEFT_OF_A_JUMP = 1e-3


def savitzky_golay(length: int, order: int, derivative: int, step: float) -> np.ndarray:
    """Weights (length,) that give the middle value, or a derivative there, of the polynomial fitted to a window.

    The same numbers as scipy.signal's, which works in powers of sample numbers, keeps nine digits of order 4 over 101
    samples and none of order 9 over 401, and whose import alone would take a quarter of a fit.

    Source: Savitzky & Golay 1964.
    """
    half = length // 2
    _, rows = _fitted(half, order)
    return rows[derivative] * math.factorial(derivative) / (half * step) ** derivative


def _fitted(half: int, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (n,) in a window of 2 half + 1 samples, on [-1, 1], where powers stay apart, and the weights (order + 1, n) that give the
    coefficients of the polynomial fitted to it."""
    u = np.arange(-half, half + 1) / half
    return u, np.linalg.pinv(np.vander(u, order + 1, increasing=True))


def differences(q, step: float) -> tuple[np.ndarray, np.ndarray]:
    """qd, qdd (n, dof) of angles (n, dof) `step` seconds apart, by central differences; not to be used in the first and last row."""
    qdd = np.zeros_like(q)
    qdd[1:-1] = (q[2:] - 2.0 * q[1:-1] + q[:-2]) / step**2
    return np.gradient(q, step, axis=0), qdd


def _convolved(values, weights) -> np.ndarray:
    """Values (n, ...) weighted by a window about each; the first and last half window are not to be used."""
    flat = values.reshape(len(values), -1)
    out = np.empty(flat.shape)
    for k in range(flat.shape[1]):
        out[:, k] = np.convolve(flat[:, k], weights[::-1], mode="same")
    return out.reshape(values.shape)


def rate(values, step: float, half: float, order: int) -> np.ndarray:
    """Rate (..., n) of values (..., n) `step` seconds apart: that of the polynomial fitted to `half` samples on either side; of the first
    and the last window, at either end.

    Args:
        half: at most (n - 1) / 2; between two whole numbers the mean of both, so that nothing jumps with it.
    """
    whole = int(half)
    slopes = _slopes(whole, order, step)
    if half > whole:
        wider = _slopes(whole + 1, order, step)
        same = np.zeros_like(wider)  # the narrower window about each place of the wider one
        same[: whole + 1, :-2], same[whole + 1, 1:-1], same[whole + 2 :, 2:] = slopes[: whole + 1], slopes[whole], slopes[whole:]
        slopes = same + (half - whole) * (wider - same)
    return _windowed(values, slopes)


def smoothed(values, half: int, order: int) -> np.ndarray:
    """Values (..., n) of the polynomial fitted to `half` samples on either side; of the first and the last window, at either end.

    Args:
        half: at most (n - 1) / 2.
    """
    u, rows = _fitted(half, order)
    return _windowed(values, np.vander(u, order + 1, increasing=True) @ rows)


def _windowed(values, weights) -> np.ndarray:
    """What weights (k, k) of a window make of values (..., n) at each of its samples: of the window about a value at its middle, of
    the first and the last window at either end."""
    length, middle = len(weights), len(weights) // 2
    out = np.moveaxis(_convolved(np.moveaxis(values, -1, 0), weights[middle]), 0, -1)
    out[..., :middle] = values[..., :length] @ weights[:middle].T
    out[..., -middle:] = values[..., -length:] @ weights[-middle:].T
    return out


def _slopes(half: int, order: int, step: float) -> np.ndarray:
    """Weights (n, n) that give the rate at each of the n = 2 half + 1 samples of a window."""
    u, rows = _fitted(half, order)
    return np.vander(u, order, increasing=True) @ (np.arange(1, order + 1)[:, None] * rows[1:]) / (half * step)


class Smoother:
    """A linear, zero-phase filter over samples, with the reach [samples] of its memory."""

    every = 1  # of how many samples it leaves one worth keeping

    def __init__(self, spec: PreprocessSpec, step: float):
        self.kind, self.order, self.step = spec.filter, spec.order, step
        if self.kind == "savitzky-golay":
            self.length = 2 * round(spec.window / (2.0 * step)) + 1
            if self.length <= self.order:
                raise ConfigError(
                    f"preprocess.window of {spec.window:g} s is {self.length} samples at {1 / step:.4g} Hz",
                    allowed=f"more than order = {self.order} samples, {(self.order + 1) * step:.3g} s", do="widen the window, or name the unit of the time stamps in data.units.time where it is not s",
                )  # fmt: skip
            self.reach = self.length // 2
        elif self.kind == "butterworth":
            if spec.cutoff >= 0.5 / step:
                raise ConfigError(f"preprocess.cutoff of {spec.cutoff:g} Hz at {1 / step:.4g} Hz sampling", allowed=f"below {0.5 / step:.4g} Hz")
            from scipy.signal import butter

            self.sections = butter(self.order, spec.cutoff, fs=1.0 / step, output="sos")
            # five time constants of the slowest pole: what is left of an edge is below one per cent
            slowest = 2.0 * math.pi * spec.cutoff * math.sin(math.pi / (2 * self.order))
            self.reach = max(1, math.ceil(5.0 / (slowest * step)))
        else:
            self.reach = 0

    def smear(self, both: bool) -> tuple[int, float]:
        """What the filter makes of a joint's reversal: how far it carries it [samples], and the speed of a stop [s].

        Friction changes sign with the speed and torque does not, so the acceleration jumps where qd = 0, which the filter
        spreads. By M(q) dqdd = e_j jump it is joint j's own torque alone that this bends. Of an angle whose speed falls
        to zero and rises again, qd = a |t|, the filter makes a speed that is never below a times the second number.

        Args:
            both: whether the filter also goes over torque and over what is predicted.
        """
        if not self.reach:
            return 0, 0.0
        t, middle, qd, qdd = self.of_a_jump()
        error = (qdd - np.heaviside(t, 0.5))[middle]
        most = _LEFT_OF_A_JUMP * np.sum(error**2)
        return int(np.count_nonzero(self.bent_beyond(both) > most)), 2.0 * abs(float(qd[len(t) // 2, 0]))

    def of_a_jump(self) -> tuple[np.ndarray, slice, np.ndarray, np.ndarray]:
        """Of an acceleration that jumps from none to one: times (n, 1) [s] from there, the rows to be used, and qd and qdd (n, 1) as the
        filter gives them."""
        t = self.step * np.arange(-6 * self.reach, 6 * self.reach + 1)[:, None]
        return t, slice(3 * self.reach, -3 * self.reach), *self.differentiate(0.5 * np.maximum(t, 0.0) ** 2)[1:]

    def bent_beyond(self, both: bool) -> np.ndarray:
        """Sums of squares (n,) of what the filter makes of such a jump in rows that are as many samples from it or more.

        Args:
            both: as of `smear`.
        """
        t, middle, _, qdd = self.of_a_jump()
        error = qdd - np.heaviside(t, 0.5)
        square = (self(error) if both else error)[middle, 0] ** 2
        half = len(square) // 2
        return np.cumsum(np.append(square[half], square[half + 1 :] + square[half - 1 :: -1])[::-1])[::-1]

    def differentiate(self, q) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """q, qd, qdd (n, dof) of measured angles (n, dof); the first and last `reach` rows are not to be used."""
        if self.kind == "savitzky-golay":
            q0, q1, q2 = (_convolved(q, savitzky_golay(self.length, self.order, d, self.step)) for d in range(3))
            return q0, q1, q2
        smooth = self(q)
        return smooth, *differences(smooth, self.step)

    def rates(self, values) -> np.ndarray:
        """Values (n,), n > 1, with their first two derivatives (3, n), to their very ends, beyond which they go on as they came: what
        `differentiate` makes of an angle that turns by them."""
        edge = self.reach + 1  # and one of a difference
        padded = np.pad(values, edge, mode="reflect", reflect_type="odd")[:, None]
        return np.stack([own[edge:-edge, 0] for own in self.differentiate(padded)])

    def __call__(self, values, axis: int = 0) -> np.ndarray:
        """The filtered values, same shape; samples along `axis`."""
        if self.kind == "savitzky-golay":
            weights = savitzky_golay(self.length, self.order, 0, self.step)
            return np.moveaxis(_convolved(np.moveaxis(values, axis, 0), weights), 0, axis)
        if self.kind == "butterworth":
            from scipy.signal import sosfiltfilt

            return sosfiltfilt(self.sections, values, axis=axis)
        return values

    def at(self, values, rows: slice) -> np.ndarray:
        """The filtered values (..., n) at some rows of the last axis."""
        return self(values, axis=-1)[..., rows]
