"""Noise from the spectrum of what is left of a residual.

Above the motion's band it is noise; within it may hold misfit. The noise there is weighed over
models of it (white, and white plus one coloured part), each band of frequencies being clean or
misfit.
"""

import math
from dataclasses import dataclass

import numpy as np

from .colours import models
from .stretches import lost

_BANDS_PER_OCTAVE = 6
_MANY_RUNS = 8  # take little of the first ordinate with their common mean
_INDEPENDENT = 1.94  # ordinates of a Hann-windowed periodogram per independent one
# In bandwidths: from here up the residual is noise as it is, hum and all; up to here the noise's
# colour is fitted, farther up says nothing about the band; and the corner about which a coloured
# part ceases to look like misfit.
_SAFE, _FIT, _DOUBT = 10.0, 30.0, 5.0
# most ordinates that a band counts for, below and above `_SAFE`: no noise is quite the model's
_VOTE, _VOTE_FAR = 4.0, 60.0
_FARTHEST = math.log(1e4)  # misfit may lift a band by any factor up to this
# Of what functions of the motion took off, for want of a better one; most chance that a coloured
# part is misfit; and the relative error of the RMS as no noise is quite the model's: calibrated on
# simulated residuals, so that two standard errors
# cover nine in ten.
_LEFT_BEHIND, _MISTAKEN, _COLOURS = 0.015, 0.25, 0.03
# What the angles' noise makes: share of a band's power below which it is nothing; ordinates that
# its size counts as known by (a draw has 0.6 to 1.7 of its RMS on simulated logs whose stamps
# jitter: half a log unit, each way); bands over which a draw is smoothed; and the relative error
# of its part of the RMS, as it is no stationary noise: of 95 such joints two standard errors then
# cover eight in ten.
_NOTHING, _DRAWN, _SMOOTH, _CARRIED = 0.01, 2.0, 2.0, 0.1
_ROUNDS = 40  # of which two parts need more
_TINY = 1e-300


@dataclass(frozen=True)
class Spectrum:
    """A residual in bands of frequency: centre and width [Hz], mean density [(N m)^2/Hz],
    independent ordinates, all (bands,). The first band lies below what was looked at: no
    ordinates."""

    centre: np.ndarray
    width: np.ndarray
    density: np.ndarray
    count: np.ndarray


@dataclass(frozen=True)
class Weighed:
    """RMS of the noise, its standard error, RMS of what is noise in any case, words on its colour,
    and the largest part of its error."""

    rms: float
    std: float
    least: float
    colour: str
    doubt: str


def spectrum_of(values: list[np.ndarray], kept: list[np.ndarray], steps: list[float]) -> Spectrum:
    """The Hann-windowed periodograms of all runs, averaged in bands of equal ratio.

    Args:
        values: (n,) of each run, bridged where not `kept` (n,): what is bridged has no noise.
    """
    frequency, density = [], []
    # the first ordinate holds the mean, which spreads to the second; over many runs little of it
    # was taken off
    first = 2 if len(values) < _MANY_RUNS else 1
    for y, k, step in zip(values, kept, steps):
        window = np.hanning(len(y) + 2)[1:-1]
        at = np.fft.rfftfreq(len(y), step)[first:-1]  # the last is half an ordinate
        mean = y[k].mean() if first == 2 else 0.0
        power = np.abs(np.fft.rfft((y - mean) * window)[first:-1]) ** 2 / (window @ window)
        frequency.append(at)
        power *= _over_all(y, k, window**2) / (1.0 - lost(k, window**2, at * step))
        density.append(2.0 * step * power)
    frequency, density = np.concatenate(frequency), np.concatenate(density)
    band = np.log2(frequency / frequency.min()) * _BANDS_PER_OCTAVE + 1e-9
    _, band, count = np.unique(band.astype(np.int64), return_inverse=True, return_counts=True)
    centre, mean = np.bincount(band, frequency) / count, np.bincount(band, density) / count
    lowest = frequency.min() * 2.0 ** (-0.5 / _BANDS_PER_OCTAVE)
    edges = np.concatenate([[0.0, lowest], 0.5 * (centre[1:] + centre[:-1]), [0.5 / min(steps)]])
    mean = np.maximum(mean, 1e-12 * mean.max())
    return Spectrum(
        np.concatenate([[0.5 * lowest], centre]), np.diff(edges), np.concatenate([mean[:1], mean]),
        np.concatenate([[0.0], np.maximum(count / _INDEPENDENT, 0.5)]),
    )  # fmt: skip


def _over_all(values, kept, weight) -> float:
    """How much louder noise is, by steps from row to row, than where a window weighs most."""
    pairs = kept[1:] & kept[:-1]
    square, weight = np.diff(values)[pairs] ** 2, weight[1:][pairs]
    seen = float(weight @ square)
    return float(square.mean() * weight.sum()) / seen if seen > 0.0 else 1.0


def weighed(
    spectrum: Spectrum, bandwidth: float, step: float, removed: float, angles=None
) -> Weighed:
    """Noise power, the mean over models of the noise by their posterior probability.

    A band that holds misfit lies above the noise by any factor, evenly in its logarithm, and never
    below. A coloured part with its corner near the motion's band looks like misfit, the more so the
    more misfit was found: `removed` [(N m)^2].

    Args:
        angles: density (bands,) that the noise of the angles makes [(N m)^2/Hz], as well as one
            knows its size; None: none.
    """
    from scipy.special import gammaln, ndtr

    f, seen, width = spectrum.centre, spectrum.density, spectrum.width
    looked, count = spectrum.count > 0.0, np.maximum(spectrum.count, 0.5)
    corner, coloured = models(f, bandwidth, step)
    shape = 1.0 + coloured
    # white is as likely as all colours
    prior = np.concatenate([[0.5], np.full(len(corner) - 1, 0.5 / (len(corner) - 1))])
    # near half the sampling rate filters bend the spectrum
    use = looked & (f <= max(min(0.35 / step, _FIT * bandwidth), f[min(5, len(f) - 1)]))
    # prior chance that a band holds misfit
    suspect = np.maximum(0.5 / (1.0 + (f / (2.0 * bandwidth)) ** 2), 0.02)
    weight = np.minimum(count, np.where(f < _SAFE * bandwidth, _VOTE, _VOTE_FAR))
    clear = use & (f > min(2.0 * bandwidth, f[use][-1] / 2.0))
    level = np.median((seen / shape)[:, clear], axis=1)  # of each model's white part
    known = angles is not None and bool((angles > _NOTHING * seen)[use].any())
    made = _smoothed(angles, spectrum.count) if known else np.zeros(len(f))
    size = np.ones(len(corner))
    for _ in range(_ROUNDS if known else 12):  # expectation-maximisation
        modelled = level[:, None] * shape + size[:, None] * made
        z = seen / modelled
        clean = np.log1p(-suspect) + weight * np.log(weight * z) - gammaln(weight) - weight * z
        # the chance that clean ordinates would have come out lower than this (Wilson & Hilferty
        # 1931)
        lower = ndtr(3.0 * np.sqrt(count) * (np.cbrt(z) - 1.0 + 1.0 / (9.0 * count)))
        lifted = np.log(suspect / _FARTHEST) + np.log(lower + _TINY)
        share = looked / (1.0 + np.exp(np.clip(lifted - clean, -500.0, 500.0)))
        votes = share * weight * use + 1e-12 * looked
        if not known:
            level = np.sum(votes * seen / shape, axis=1) / np.sum(votes, axis=1)
            continue
        # of a sum of two, each grows where more was seen than modelled (Lee & Seung 2001)
        part = votes * shape / modelled
        level = level * np.sum(part * z, axis=1) / np.sum(part, axis=1)
        part = votes * made / modelled
        more = np.sum(part * z, axis=1) + _DRAWN / size**2
        size = size * more / (np.sum(part, axis=1) + _DRAWN / size)
    evidence = np.logaddexp(clean, lifted)[:, use].sum(axis=1) + np.log(prior)
    chance = np.exp(evidence - evidence.max())
    chance /= chance.sum()
    modelled = level[:, None] * shape + size[:, None] * made
    share = np.where(looked & (f > _SAFE * bandwidth), 1.0, share)
    power = (share * seen + (1.0 - share) * modelled) @ width
    sampling = ((modelled * width) ** 2 / count).sum(axis=1)
    near = f <= _SAFE * bandwidth
    doubtful = np.minimum((level[:, None] * coloured)[:, near] @ width[near], 0.98 * power)
    # the chance that it is misfit: the functions are many and rarely leave so much
    doubt = _MISTAKEN * removed / (removed + doubtful + _TINY)
    doubt /= 1.0 + (corner / (_DOUBT * bandwidth)) ** 2
    estimate = power - doubt * doubtful
    mean = float(chance @ estimate)
    spread = (estimate - mean) ** 2 + doubt * (1.0 - doubt) * doubtful**2
    sampled = float(chance @ sampling) + (2.0 * _COLOURS * mean) ** 2
    sampled += (2.0 * _CARRIED * min(mean, float(made @ width))) ** 2
    parts = {
        "noise slower than the motion cannot be told from misfit": float(chance @ spread),
        "the log is too short for how slow its noise is": sampled,
        "the misfit is much larger than the noise": min(_LEFT_BEHIND * removed, mean) ** 2,
    }
    best = 1 + int(np.argmax(chance[1:]))
    colour = f"white plus a coloured part with a corner of {corner[best]:.2g} Hz"
    colour = "white" if chance[0] > 0.5 else colour
    rms = math.sqrt(mean)
    least = math.sqrt(float(seen[~near] @ width[~near]))
    std = math.sqrt(sum(parts.values())) / (2.0 * rms)
    return Weighed(rms, std, least, colour, max(parts, key=parts.get))


def _smoothed(density: np.ndarray, count: np.ndarray) -> np.ndarray:
    """A density (bands,) of so many ordinates, the mean over bands nearby."""
    at = np.arange(len(density))
    near = np.exp(-0.5 * ((at[:, None] - at) / _SMOOTH) ** 2) * np.maximum(count, 1e-3)
    return near @ density / near.sum(axis=1)
