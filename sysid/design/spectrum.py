"""The spectrum of a fit's noise, from what the fit left of its training logs, and what noise of that
spectrum makes of sums over rows.

A fit takes a share of the noise into its parameters: at a frequency f the residual's periodogram is,
on average, S(f) (1 - h(f)) times the rows that count, with h(f) the leverage of the fit's columns
there. A poor log's motion is slow, so that most of what is missing is missing where the next log
will be read. S is white noise with what the noise of the angles makes of torque, whose shape is known
(`sysid.noise.of_angles`); log S may walk away from that over bands of the logarithm of frequency, and
where little is left to tell it from, it stays as it is beside. Ordinates are exponential and count as
1 - h each; the share of the angles and the steps of the walk, none among them, are averaged over by
their marginal likelihood (Laplace's approximation).

Source: Whittle 1953; Kitagawa & Gersch 1985 (smoothness priors of spectra), here over log f.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.fft import next_fast_len

from ..motion import Motion

_STRETCH = 16384  # rows: noise is not told apart from drift beyond
_BANDS_PER_OCTAVE = 3
_STEPS = (0.0, 0.05, 0.1, 0.2, 0.4, 0.8)  # of log S from band to band: 0.8 is 10 dB an octave
_LEAST = 1e-3  # of an ordinate: less is left of it than rounding and friction's corners put there
_SHARES = (
    0.0,
    *np.geomspace(0.05, 20.0, 9),
)  # of the angles in the noise, over that of the white part
_FREE = 1e6  # variance of log S itself: nothing is known of it
_ROUNDS, _SETTLED = 60, 1e-9


@dataclass(frozen=True)
class Noise:
    """log S [(N m)^2 a row] at frequencies [Hz], both (bands,), and on straight lines over log f
    between them; white noise of variance s^2 has S = s^2."""

    frequency: np.ndarray
    level: np.ndarray

    def density(self, frequency) -> np.ndarray:
        """S (n,) at frequencies (n,) [Hz]."""
        at = np.log(np.maximum(frequency, 1e-9 * self.frequency[0]))
        return np.exp(np.interp(at, np.log(self.frequency), self.level))


def white(variance: float) -> Noise:
    """Noise without a colour."""
    return Noise(np.ones(1), np.log([max(variance, 1e-300)]))


def noise_of_periodograms(frequency, power, kept, made) -> Noise:
    """The noise of which a fit left so much.

    Args:
        frequency (n,) [Hz], above zero; power (n,) [(N m)^2] of what is left over the rows that count;
            kept (n,): the share of the noise that the fit did not take; made (n,): power of what the
            angles' noise makes.
    """
    use = kept > _LEAST
    f, share, left = frequency[use], kept[use], power[use]
    if not np.any(left > 0.0):
        return white(0.0)
    number = np.floor(np.log2(f / f.min()) * _BANDS_PER_OCTAVE + 1e-9).astype(int)
    _, number = np.unique(number, return_inverse=True)
    count = np.bincount(number, share)
    mean = np.average(left / share, weights=share)
    seen = np.maximum(np.bincount(number, left) / count, 1e-12 * mean)
    centre = np.exp(np.bincount(number, share * np.log(f)) / count)
    shape = np.bincount(number, made[use]) / np.bincount(number)
    shares = _SHARES if shape.any() else _SHARES[:1]
    shape = shape / (np.mean(made) or 1.0)
    walks = [
        _walked(seen, count, np.log1p(share * shape), step) for share in shares for step in _STEPS
    ]
    likely = np.exp([own - max(own for _, own in walks) for _, own in walks])
    mean = np.average(np.exp([level for level, _ in walks]), axis=0, weights=likely)
    return Noise(centre, np.log(mean))


def _walked(seen, count, offset, step: float) -> tuple[np.ndarray, float]:
    """log S (bands,) most likely, and the logarithm of the marginal likelihood.

    Args:
        seen (bands,): mean power; count (bands,): ordinates. offset (bands,): from which log S walks
            away. step: deviation of that from a band to the next.
    """
    n, seen = len(seen), seen * np.exp(-offset)
    # coordinates in which the walk's steps are unit normal: the level, and as many steps
    basis = np.column_stack([np.ones(n), step * np.tril(np.ones((n, n)), -1)[:, : n - 1]])
    prior = np.append(1.0 / _FREE, np.ones(n - 1))
    lost = lambda z: float(  # noqa: E731
        count @ (basis @ z + seen * np.exp(-(basis @ z))) + 0.5 * prior @ (z - start) ** 2
    )
    start = np.append(np.log(np.average(seen, weights=count)), np.zeros(n - 1))
    z, here = start, lost(start)
    for _ in range(_ROUNDS):
        ratio = seen * np.exp(-(basis @ z))
        slope = basis.T @ (count * (1.0 - ratio)) + prior * (z - start)
        # what is expected of the curvature, which holds far from the optimum, too
        curve = (basis * (count * np.maximum(ratio, 1.0))[:, None]).T @ basis + np.diag(prior)
        change = np.linalg.solve(curve, slope)
        while (there := lost(z - change)) > here and np.abs(change).max() > _SETTLED:
            change = 0.5 * change
        if there > here:
            break
        z, before, here = z - change, here, there
        if before - here < _SETTLED * max(abs(here), 1.0):
            break
    ratio = seen * np.exp(-(basis @ z))
    curve = (basis * (count * ratio)[:, None]).T @ basis + np.diag(prior)
    return offset + basis @ z, -here - count @ offset - 0.5 * np.linalg.slogdet(curve)[1]


@dataclass(frozen=True)
class Stretch:
    """Rows of a joint, one after another. joint; support (k,): which parameters its columns (k, n)
    are of; zero where a row does not count; step [s]; count: rows that do; rows: which of a motion's
    usable rows, over all pieces."""

    joint: int
    support: np.ndarray
    columns: np.ndarray
    step: float
    count: int
    rows: slice

    @property
    def period(self) -> int:
        """Rows that a spectrum is taken of, the last ones zero: a length whose transform is quick."""
        return next_fast_len(self.columns.shape[1], real=True)

    @property
    def frequency(self) -> np.ndarray:
        """(m,) [Hz] of the ordinates of a real spectrum."""
        return np.fft.rfftfreq(self.period, self.step)

    def spectrum(self, values) -> np.ndarray:
        """(..., m) of values (..., n) of the rows."""
        return np.fft.rfft(values, self.period)


def stretches(model, motion: Motion) -> Iterator[Stretch]:
    """The columns of a model (or of its slopes, `Linearised`) along a motion, by joint, in stretches
    that are long against any noise's memory."""
    done = 0
    for piece in motion.pieces:
        remembered = model.remembered(piece)
        parts = max(1, round(piece.samples / _STRETCH))
        edges = piece.core.start + np.arange(parts + 1) * piece.samples // parts
        for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist()):
            found = model.columns(piece, slice(start, stop), remembered)
            rows = slice(done, done + stop - start)
            done = rows.stop
            for joint, columns in enumerate(found):
                count = stop - start
                if piece.use is not None:
                    use = piece.use[start:stop, joint]
                    columns, count = columns * use, int(use.sum())
                if count:
                    support = model.support(joint, piece)
                    yield Stretch(joint, support, columns, piece.step, count, rows)


def noise_left(parts: Iterable[Stretch], residual, change, made, takes: Callable) -> list[Noise]:
    """The noise of each joint.

    Args:
        residual (n, dof) [N m or N]: what is left of the rows, zero where one does not count, before
            the parameters change by `change`; made (n, dof, draws): what the noise of the angles makes, drawn again.
        takes: (stretch, its spectrum) -> h (m,) times the rows that count.
    """
    heaps: list[list] = [[] for _ in range(residual.shape[1])]
    for part in parts:
        # the mean is a column of its own at most: the first ordinate says little
        at = slice(1, None)
        rest = residual[part.rows, part.joint] - change[part.support] @ part.columns
        left = np.abs(part.spectrum(rest)[at]) ** 2 / part.count
        kept = 1.0 - takes(part, part.spectrum(part.columns)[:, at]) / part.count
        drawn = np.abs(part.spectrum(made[part.rows, part.joint].T)[:, at]) ** 2
        angles = drawn.mean(axis=0) / len(rest)
        heaps[part.joint].append((part.frequency[at], left, np.clip(kept, 0.0, 1.0), angles))
    none = white(0.0)
    return [noise_of_periodograms(*map(np.concatenate, zip(*h))) if h else none for h in heaps]


def scatter(part: Stretch, noise: Noise) -> np.ndarray:
    """(k, k) covariance of columns' products with the noise of their rows."""
    f = part.frequency
    each = noise.density(f) * np.where((f == 0) | (2 * f * part.step == 1), 1, 2)
    scaled = part.spectrum(part.columns) * np.sqrt(each / part.period)
    return (scaled @ scaled.conj().T).real
