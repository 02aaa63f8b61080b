"""The noise floor of a torque signal: the RMS that a perfect model would leave, found without a perfect model.

Where the motion repeats itself, the scatter between repeats is the noise, whatever its colour and whatever the model
lacks. Elsewhere, what plain functions of the motion explain is first taken off the residual, whichever effect that may
be. The spectrum of the rest is noise above the motion's band and may still hold misfit within; the noise there is
weighed over models of it (white, and white plus one coloured part), each band of frequencies being clean or misfit.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

_MOST_SAMPLES, _FEWEST_SAMPLES = 120_000, 40  # looked at over all stretches; of a stretch worth looking at
# Repeats: rms difference of each joint's positions, share of its range; and how far away it must have been in between.
_TOLERANCE, _AWAY = 0.003, 0.05
_BLOCKS = 30
_BANDWIDTH_SHARE = 0.995  # of the power of every joint's velocity
# Functions of the motion are fitted at this many samples per period of the bandwidth, and taken where they explain this
# many times the mean square of what is left; a share of what they took off may have stayed, for want of a better function.
_FUNCTION_RATE, _GAIN, _RIPPLES, _LEFT_BEHIND = 40.0, 12.0, 4, 0.03
# Reversals: share of the rms speed below which a joint is slow, of the time it may be, of the time that must remain; and
# the ratio of mean squares, slow over fast, that noise does not have.
_SLOW, _MOST_SLOW, _FEWEST_KEPT, _LARGER = 0.12, 0.2, 0.6, 2.0
_BANDS_PER_OCTAVE = 6
_INDEPENDENT = 1.94  # ordinates of a Hann-windowed periodogram, and second differences of repeats, per independent one
# In bandwidths: from here up the residual is noise as it is, hum and all; up to here the noise's colour is fitted,
# farther up says nothing about the band; and the corner about which a coloured part ceases to look like misfit.
_SAFE, _FIT, _DOUBT = 10.0, 30.0, 5.0
_VOTE, _VOTE_FAR = 4.0, 60.0  # most ordinates that a band counts for, below and above `_SAFE`: no noise is quite the model's
_FARTHEST = math.log(1e4)  # misfit may lift a band by any factor up to this
_SLOWEST = 0.3  # Hz, corner of the slowest noise; slower is drift
_TINY = 1e-300


@dataclass(frozen=True)
class NoiseFloor:
    """RMS of a joint's torque noise [N m or N], its standard error, "repeats" or "spectral", and how it was found."""

    rms: float
    std: float
    method: str
    detail: str


@dataclass(frozen=True)
class _Stretch:
    """Contiguous samples: a joint's residual, torque as logged and as predicted (n,) [N m or N], all joints' positions (n, dof), step [s]."""

    residual: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    q: np.ndarray
    step: float
    joint: int


@dataclass(frozen=True)
class _Rest:
    """Residual (n,) of each stretch without what functions of the motion explain, how many they were, the power they took off."""

    values: list[np.ndarray]
    functions: int
    removed: float


@dataclass(frozen=True)
class _Spectrum:
    """A residual in bands of frequency: centre and width [Hz], mean density [(N m)^2/Hz], independent ordinates, all (bands,)."""

    centre: np.ndarray
    width: np.ndarray
    density: np.ndarray
    count: np.ndarray


def floor(
    residual: Sequence[np.ndarray], measured: Sequence[np.ndarray], q: Sequence[np.ndarray], step: Sequence[float], joint: int,
) -> NoiseFloor:  # fmt: skip
    """The noise floor of one joint's torque as logged; never above the residual's own RMS.

    One entry per contiguous stretch of samples. Noise slower than 0.3 Hz counts as drift, not as noise.

    Args:
        residual: (n, dof) measured minus predicted torque [N m or N], not filtered; the model may be wrong.
        measured: (n, dof) torque as logged [N m or N].
        q: (n, dof) smoothed positions [rad or m].
        step: [s].
        joint: which column.
    """
    rows = sum(len(r) for r in residual)
    own = math.sqrt(sum(float(np.sum(r[:, joint] ** 2)) for r in residual) / max(rows, 1))
    size = max((float(np.abs(m[:, joint]).max()) for m in measured if len(m)), default=0.0)
    stretches = _longest(residual, measured, q, step, joint)
    if own <= 1e-12 * size:
        return NoiseFloor(own, 0.0, "spectral", "the model leaves nothing of the torque")
    if not stretches:
        return NoiseFloor(own, own, "spectral", f"{rows} samples are too few: the residual's own RMS")
    # a short stretch cannot tell frequencies apart
    bandwidth = max(_bandwidth(s.q, s.step) for s in stretches if 2 * len(s.q) >= len(stretches[0].q))
    rest = _without_motion(stretches, bandwidth)
    if math.sqrt(max(np.mean(v**2) for v in rest.values)) <= 1e-12 * max(size, own):
        return NoiseFloor(0.0, 0.0, "spectral", "the residual is a constant, or a function of the motion")
    found = _repeats(stretches, rest) or _spectral(stretches, rest, bandwidth)
    return NoiseFloor(min(found.rms, own), found.std, found.method, found.detail)


def _longest(residual, measured, q, step, joint: int) -> list[_Stretch]:
    """The longest stretches, the longest first, `_MOST_SAMPLES` in all."""
    kept, left = [], _MOST_SAMPLES
    for k in sorted(range(len(residual)), key=lambda k: -len(residual[k])):
        n = min(len(residual[k]), left)
        if n < _FEWEST_SAMPLES:
            break
        r, m = residual[k][:n, joint], measured[k][:n, joint]
        kept.append(_Stretch(r, m, m - r, q[k][:n], float(step[k]), joint))
        left -= n
    return kept


def _repeats(stretches: list[_Stretch], rest: _Rest) -> NoiseFloor | None:
    """Noise from the scatter between repeats of the motion, None where nothing repeats.

    Second differences over three repeats (first over two) leave out what drifts in step with time. Shifts are by whole
    samples, so that nothing is done to the noise.
    """
    periods = [_period(s.q) for s in stretches]
    found = []
    # Without what functions explain, little is left that half a sample's shift or a motion a little different could
    # turn into scatter. The torque itself is for a model that is nonsense. Each scatters by the noise or more.
    for signals in (rest.values, [s.residual for s in stretches], [s.measured for s in stretches]):
        squares = []
        for values, period in zip(signals, periods):
            if period is None:
                continue
            n, one, two = len(values), round(period), round(2 * period)
            if n >= 3 * period:
                squares.append((values[: n - two] - 2.0 * values[one : one + n - two] + values[two:]) ** 2 / 6.0)
            else:
                squares.append((values[one:] - values[:-one]) ** 2 / 2.0)
        if not squares:
            return None
        found.append(_block_rms(np.concatenate(squares)))
    stretch, period = next((s, p) for s, p in zip(stretches, periods) if p is not None)
    return NoiseFloor(*min(found), "repeats", f"period of {period * stretch.step:.3f} s found, {int(len(stretch.q) / period + 0.01)} repeats")


def _block_rms(squares: np.ndarray) -> tuple[float, float]:
    """RMS and its standard error, from blocks of time."""
    blocks = np.array([block.mean() for block in np.array_split(squares, min(_BLOCKS, len(squares)))])
    rms = math.sqrt(squares.mean())
    return rms, float(blocks.std(ddof=1)) * math.sqrt(_INDEPENDENT / len(blocks)) / (2.0 * rms + _TINY)


def _moving(q: np.ndarray) -> np.ndarray:
    span = np.ptp(q, axis=0)
    return (span > 1e-3 * span.max()) & (span > 0)


def _period(q: np.ndarray) -> float | None:
    """The samples, seldom whole, after which all joints come back, and have time to do so twice; None where they do not."""
    n, moving = len(q), _moving(q)
    if not moving.any():
        return None
    x = (q[:, moving] - q[:, moving].mean(0)) / np.ptp(q[:, moving], axis=0)
    lag = np.arange(n // 2 + 1)
    spectrum = np.fft.rfft(x, 1 << (2 * n - 1).bit_length(), axis=0)
    products = np.fft.irfft(np.abs(spectrum) ** 2, axis=0)[lag]
    before = np.concatenate([np.zeros((1, x.shape[1])), np.cumsum(x**2, axis=0)])
    distance = (before[n - lag] + before[n] - before[lag] - 2.0 * products) / (n - lag)[:, None]  # mean squares, each joint's
    worst = distance.max(axis=1)
    away = np.flatnonzero(worst > _AWAY**2)
    if not len(away):
        return None
    moves = np.mean(np.diff(x, axis=0) ** 2, axis=0)  # in one sample: a period that ends between two is missed by some of it
    last = 0
    for first in np.flatnonzero((distance < _TOLERANCE**2 + 0.25 * moves).all(axis=1) & (lag > away[0])):
        if first <= last:
            continue
        last = int(first)
        while last + 1 < len(lag) and worst[last + 1] < worst[last]:
            last += 1
        if last + 1 == len(lag):
            break
        below, here, above = distance[last - 1 : last + 2].sum(axis=1)
        offset = 0.5 * (below - above) / max(below - 2.0 * here + above, _TINY)
        if abs(offset) <= 1.0 and (distance[last] - moves * offset**2 < _TOLERANCE**2).all():
            return last + offset
    return None


def _bandwidth(q: np.ndarray, step: float) -> float:
    """Hz below which `_BANDWIDTH_SHARE` of every joint's velocity lies; 0 where none moves."""
    velocity = np.diff(q[:, _moving(q)], axis=0)
    if not velocity.size:
        return 0.0
    power = np.cumsum(np.abs(np.fft.rfft(velocity * np.hanning(len(velocity))[:, None], axis=0)) ** 2, axis=0)
    within = (power < _BANDWIDTH_SHARE * power[-1]).sum(axis=0)
    return float(within.max() / (len(velocity) * step))


def _without_motion(stretches: list[_Stretch], bandwidth: float) -> _Rest:
    """Functions of the motion are taken off one after the other (orthogonal matching pursuit), each while it explains more
    than noise would let it, and at most as many as leave three quarters of the band's freedom to the noise."""
    y = [s.residual - s.residual.mean() for s in stretches]
    most = int(0.5 * bandwidth * sum(len(s.q) * s.step for s in stretches))
    if most < 1:
        return _Rest(y, 0, 0.0)
    # noise far above the band would hide what is in it
    thin = [max(1, int(1.0 / (s.step * _FUNCTION_RATE * bandwidth))) for s in stretches]
    mean = lambda v, m: v[: len(v) // m * m].reshape(-1, m).mean(1)  # noqa: E731
    target = np.concatenate([mean(v, m) for v, m in zip(y, thin)])
    waves = _ripples(np.concatenate([mean(s.q[:, s.joint], m) for s, m in zip(stretches, thin)]), target)
    x = np.concatenate([np.stack([mean(c, m) for c in _functions(s, waves)], axis=1) for s, m in zip(stretches, thin)])
    norm = np.sqrt(np.mean(x**2, axis=0)) + _TINY
    x /= norm
    gram, product, left = x.T @ x, x.T @ target, float(target @ target)
    chosen: list[int] = []
    free, pull = gram.copy(), product.copy()  # what of each function is free of the chosen ones, and what it would take
    while len(chosen) < most:
        size = np.diag(free)
        gain = np.where(size > 1e-6 * len(x), pull**2 / np.maximum(size, _TINY), 0.0)
        k = int(np.argmax(gain))
        if gain[k] <= _GAIN * left / len(x):
            break
        left -= gain[k]
        column = free[:, k] / math.sqrt(size[k])
        pull = pull - column * pull[k] / math.sqrt(size[k])
        free = free - np.outer(column, column)
        chosen.append(k)
    weights = np.linalg.solve(gram[np.ix_(chosen, chosen)], product[chosen]) / norm[chosen]
    factor = dict(zip(chosen, weights))
    taken = [sum((factor[k] * c for k, c in enumerate(_functions(s, waves)) if k in factor), np.zeros(len(s.q))) for s in stretches]
    return _Rest([a - b for a, b in zip(y, taken)], len(chosen), float(np.var(np.concatenate(taken))))


def _functions(stretch: _Stretch, waves: np.ndarray) -> Iterator[np.ndarray]:
    """Functions of the motion (n,) of which missing effects are made, one by one: all of them may not fit into memory."""
    q, step, torque, own = stretch.q, stretch.step, stretch.predicted, stretch.q[:, stretch.joint]
    v = np.gradient(q, step, axis=0)
    a, span = np.gradient(v, step, axis=0), np.ptp(own) or 1.0
    speed = v[:, stretch.joint]
    fast, sign, place = speed / (math.sqrt(np.mean(speed**2)) or 1.0), np.sign(speed), math.pi * (own - own.min()) / span
    time = np.arange(len(q)) / len(q)
    trig = lambda x: (np.cos(x), np.sin(x))  # noqa: E731
    # friction: of velocity, load, time and place, and what builds up over a distance
    yield from (sign, fast, fast**2, fast**3, sign * fast**2, fast * torque, sign * torque, sign * np.abs(torque))
    yield from (shape * np.exp(-np.abs(fast) / slow) for shape in (sign, 1.0) for slow in (0.05, 0.2, 0.7))
    yield from (shape * time**k for k in (1, 2) for shape in (1.0, sign, fast))
    yield from (sign * wave for k in range(1, 7) for wave in trig(k * place))
    yield from (_lagging(own, share * span) for share in (0.01, 0.03, 0.1))
    # the drive: gain, saturation, delay, ripple
    yield from (torque, torque**2, torque**3)
    for late in sorted({max(1, round(delay / step)) for delay in (0.003, 0.006, 0.01, 0.02, 0.04)}):
        yield np.concatenate([torque[:1].repeat(late), torque])[: len(torque)]
    yield from (wave for k in range(1, 9) for wave in trig(k * place))
    yield from (wave for k in waves for wave in trig(k * own))
    # the bodies
    for k in range(q.shape[1]):
        yield from (a[:, k], v[:, k], v[:, k] * speed, v[:, k] ** 2, np.sign(v[:, k]))
        yield from (size * wave for size in (1.0, a[:, k]) for angle in (q[:, k], own + q[:, k], own - q[:, k]) for wave in trig(angle))


def _ripples(q: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Wave numbers [1/rad or 1/m] of the strongest ripples over position (cogging, gear teeth) in a residual (n,)."""
    span = np.ptp(q)
    if span == 0.0:
        return np.zeros(0)
    sums, _ = np.histogram(q, 1024, weights=residual - residual.mean())
    power = np.abs(np.fft.rfft(sums, 8192)[:2048]) ** 2  # in eighths of a wave over the span; a wave is four bins at least
    peaks = 1 + np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:]))
    peaks = peaks[peaks > 32]  # slower ones are among the functions anyway
    return 2.0 * math.pi / (8.0 * span) * peaks[np.argsort(-power[peaks])[:_RIPPLES]]


def _lagging(q: np.ndarray, distance: float) -> np.ndarray:
    """The sign of motion (n,) as friction takes it up over a distance after each reversal. Source: Dahl 1968."""
    out, state = [], 0.0
    for moved in (np.diff(q, prepend=q[0]) / distance).tolist():
        state = (state + moved) / (1.0 + abs(moved))
        out.append(state)
    return np.array(out)


def _spectral(stretches: list[_Stretch], rest: _Rest, bandwidth: float) -> NoiseFloor:
    """Noise from the spectrum of the rest of the residual."""
    if bandwidth == 0.0:
        return NoiseFloor(*_block_rms(np.concatenate(rest.values) ** 2), "spectral", "nothing moves: all but the residual's mean")
    steps = [s.step for s in stretches]
    values = [_without_reversals(s, v) for s, v in zip(stretches, rest.values)]
    spectrum = _bands(values, steps)
    # what the functions took off was mostly in the band, noise as well as misfit
    freedom = 2.0 * bandwidth * sum(len(v) * step for v, step in zip(rest.values, steps))
    spectrum.density[spectrum.centre < bandwidth] /= 1.0 - min(0.5, rest.functions / max(freedom, 1.0))
    found = _weighed(spectrum, bandwidth, min(steps), rest.removed)
    # what was larger about reversals was misfit, or else noise of slow motion
    power = lambda parts: float(np.mean(np.concatenate(parts) ** 2))  # noqa: E731
    emptied = 0.5 * max(power(rest.values) - power(values), 0.0) / (2.0 * found.rms)
    return replace(found, std=math.hypot(found.std, min(emptied, found.rms)))


def _without_reversals(stretch: _Stretch, values: np.ndarray) -> np.ndarray:
    """The rest of a residual (n,), empty about the reversals of any joint where it is much larger there, as large in all.

    Sticking lasts a hundredth of the time and can hold most of the misfit.
    """
    v = np.gradient(stretch.q, stretch.step, axis=0)
    kept = np.ones(len(values), dtype=bool)
    for k in np.flatnonzero(_moving(stretch.q)):
        slow = np.abs(v[:, k]) < _SLOW * math.sqrt(np.mean(v[:, k] ** 2))
        larger = 0.0 < slow.mean() < _MOST_SLOW and np.mean(values[slow] ** 2) > _LARGER * np.mean(values[~slow] ** 2)
        if larger and (kept & ~slow).mean() >= _FEWEST_KEPT:
            kept &= ~slow
    return np.where(kept, values, 0.0) / math.sqrt(kept.mean())


def _bands(values: list[np.ndarray], steps: list[float]) -> _Spectrum:
    """The Hann-windowed periodograms of all stretches, averaged in bands of equal ratio."""
    frequency, density = [], []
    for y, step in zip(values, steps):
        window = np.hanning(len(y) + 2)[1:-1]
        frequency.append(np.fft.rfftfreq(len(y), step)[2:-1])  # the first two hold the mean, the last is half an ordinate
        density.append(2.0 * step * np.abs(np.fft.rfft((y - y.mean()) * window)[2:-1]) ** 2 / np.sum(window**2))
    frequency, density = np.concatenate(frequency), np.concatenate(density)
    band = np.floor(np.log2(frequency / frequency.min()) * _BANDS_PER_OCTAVE + 1e-9).astype(np.int64)
    _, band, count = np.unique(band, return_inverse=True, return_counts=True)
    centre, mean = np.bincount(band, frequency) / count, np.bincount(band, density) / count
    edges = np.concatenate([[0.0], 0.5 * (centre[1:] + centre[:-1]), [0.5 / min(steps)]])
    return _Spectrum(centre, np.diff(edges), np.maximum(mean, 1e-12 * mean.max()), np.maximum(count / _INDEPENDENT, 0.5))


def _weighed(spectrum: _Spectrum, bandwidth: float, step: float, removed: float) -> NoiseFloor:
    """Noise power, the mean over models of the noise by their posterior probability.

    A band that holds misfit lies above the noise by any factor, evenly in its logarithm, and never below. A coloured part
    with its corner near the motion's band looks like misfit, the more so the more misfit was found: `removed` [(N m)^2].
    """
    from scipy.special import gammaln, ndtr

    f, seen, count = spectrum.centre, spectrum.density, spectrum.count
    corner, coloured = _models(f, bandwidth, step)
    shape = 1.0 + coloured
    prior = np.concatenate([[0.5], np.full(len(corner) - 1, 0.5 / (len(corner) - 1))])  # white is as likely as all colours
    use = f <= max(min(0.35 / step, _FIT * bandwidth), f[min(4, len(f) - 1)])  # near half the sampling rate filters bend the spectrum
    suspect = np.maximum(0.5 / (1.0 + (f / (2.0 * bandwidth)) ** 2), 0.02)  # prior chance that a band holds misfit
    weight = np.minimum(count, np.where(f < _SAFE * bandwidth, _VOTE, _VOTE_FAR))
    clear = use & (f > min(2.0 * bandwidth, f[use][-1] / 2.0))
    level = np.median((seen / shape)[:, clear], axis=1)  # of each model's white part
    for _ in range(12):  # expectation-maximisation
        z = seen / (level[:, None] * shape)
        clean = np.log1p(-suspect) + weight * np.log(weight * z) - gammaln(weight) - weight * z
        # the chance that clean ordinates would have come out lower than this (Wilson & Hilferty 1931)
        lower = ndtr(3.0 * np.sqrt(count) * (np.cbrt(z) - 1.0 + 1.0 / (9.0 * count)))
        lifted = np.log(suspect / _FARTHEST) + np.log(lower + _TINY)
        share = 1.0 / (1.0 + np.exp(np.clip(lifted - clean, -500.0, 500.0)))
        votes = share * weight * use + 1e-12
        level = np.sum(votes * seen / shape, axis=1) / np.sum(votes, axis=1)
    evidence = np.logaddexp(clean, lifted)[:, use].sum(axis=1) + np.log(prior)
    chance = np.exp(evidence - evidence.max())
    chance /= chance.sum()
    modelled = level[:, None] * shape
    share = np.where(f > _SAFE * bandwidth, 1.0, share)
    power = (share * seen + (1.0 - share) * modelled) @ spectrum.width
    sampling = ((modelled * spectrum.width) ** 2 / count).sum(axis=1)
    near = f <= _SAFE * bandwidth
    doubtful = np.minimum((level[:, None] * coloured)[:, near] @ spectrum.width[near], 0.98 * power)
    doubt = 0.7 * removed / (removed + doubtful + _TINY) / (1.0 + (corner / (_DOUBT * bandwidth)) ** 2)
    # the functions are many and rarely leave so much: doubt widens the error more than it moves the estimate
    estimate = power - 0.25 * doubt * doubtful
    mean = float(chance @ estimate)
    variance = float(chance @ ((estimate - mean) ** 2 + doubt * doubtful**2 + sampling)) + min(_LEFT_BEHIND * removed, mean) ** 2
    best = 1 + int(np.argmax(chance[1:]))
    colour = "white" if chance[0] > 0.5 else f"white plus a coloured part with a corner of {corner[best]:.2g} Hz"
    rms = math.sqrt(mean)
    return NoiseFloor(rms, math.sqrt(variance) / (2.0 * rms), "spectral", f"residual above {bandwidth:.2g} Hz, {colour}")


def _models(f: np.ndarray, bandwidth: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Corner [Hz] (models,) and spectrum of the coloured part over the white one (models, bands); the first has none."""
    corners, heights = np.geomspace(max(_SLOWEST, f[0]), max(0.6 * f[-1], 2.0 * _SLOWEST), 30), np.geomspace(0.2, 1e4, 14)
    corner, height = (x.ravel()[:, None] for x in np.meshgrid(corners, heights))  # heights are at the band's edge
    keep = np.exp(-2.0 * math.pi * corner * step)
    first_order = lambda at: 1.0 / (1.0 - 2.0 * keep * np.cos(2.0 * math.pi * at * step) + keep**2)  # noqa: E731
    coloured = height * first_order(f) / first_order(max(bandwidth, f[0]))
    return np.concatenate([[np.inf], corner[:, 0]]), np.concatenate([np.zeros((1, len(f))), coloured])
