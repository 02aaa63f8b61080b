"""White noise on angles: its size, and a log with more of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..gaussian import HIGHEST, Gaussian
from ..running import running

_WINDOW = 0.1  # s
MOTION = 2.0  # times the motion's own band: with less of it bodies are told badly
_DRIFT = 1.0  # Hz: what is slower is drift, and no tone
_BAND = 4.0  # the angles' own low-pass, as a multiple of the cutoff
_HELD = 1e-9  # of an angle's range: less than any encoder's noise
_FEWEST = 50  # steps that tell a grain
_COUNTS, _NEAR = (1, 5, 15, 50), 0.05  # grains in a step, from few on; and how near to a whole one


def noise_of(q, smooth, taken: float, step: float) -> np.ndarray:
    """RMS (dof,) of white noise on angles q (n, dof): the lesser of what a low-pass took off and of
    what third differences show, as either may hold motion too; each in the middle of all windows of
    time, as about a reversal there is more."""
    held = _HELD * np.ptp(q, axis=0)
    taken_off, differences_ = (_by_window(v, step) for v in ((q - smooth) / taken, _third(q)))
    return np.minimum(_usual(taken_off, held), _usual(differences_, held))


def angle_noise(segment, cutoff: float) -> np.ndarray:
    """RMS (dof,) of white noise on the angles of a segment whose motion stays below `cutoff`
    [Hz]; see `noise_of`. Of one too short to tell, zero."""
    low = Gaussian(min(_BAND * cutoff, HIGHEST / segment.step), segment.step)
    inside = slice(low.reach, -low.reach)
    if len(segment.q[inside]) < _FEWEST:
        return np.zeros(segment.q.shape[1])
    smooth = low(segment.q, axis=0)[inside]
    return noise_of(segment.q[inside], smooth, low.taken_of_noise, segment.step)


def _usual(by_window, held) -> np.ndarray:
    """The middle (dof,) of windows (windows, dof), but for those of no more than `held` (dof,): a
    brake that is closed says nothing of the noise in motion. Zero where all are."""
    from numpy.ma import masked_less_equal, median

    return median(masked_less_equal(by_window, held), axis=0).filled(0.0)


def _third(q) -> np.ndarray:
    """Third differences of angles q (n, dof), as large as white noise on them."""
    return np.diff(q, 3, axis=0) / np.sqrt(20.0)  # 1 + 9 + 9 + 1


def _by_window(values, step: float) -> np.ndarray:
    """RMS (windows, dof) of values (n, dof) in windows of time."""
    parts = max(1, len(values) // max(8, round(_WINDOW / step)))
    # the first ones have a sample more, where the last would have less
    number = np.arange(parts + 1)
    ends = number * (len(values) // parts) + np.minimum(number, len(values) % parts)
    return np.sqrt(np.add.reduceat(values**2, ends[:-1], axis=0) / np.diff(ends)[:, None])


def again(segment, noise, cutoff: float, rng: np.random.Generator):
    """A segment with the noise of its angles once more (see `rougher`), and with what was left of
    its clock's errors: all signals are late or early by the same."""
    q, tau = rougher(segment, noise, cutoff, rng), segment.tau
    if segment.clock is not None:
        late = segment.clock.drawn(rng)[:, None]
        rate = lambda values: np.gradient(values, segment.step, axis=0)  # noqa: E731
        q, tau = q + late * rate(segment.q), tau + late * rate(tau)
    return replace(segment, q=q, tau=tau)


def noisier(logs, noise, cutoff: float, rng: np.random.Generator) -> list:
    """Logs with the noise of their angles once more.

    Args:
        noise: a segment's (dof,). cutoff: as of `rougher`.
    """
    drawn = lambda segment: again(segment, noise(segment), cutoff, rng)  # noqa: E731
    return [replace(log, segments=tuple(map(drawn, log.segments))) for log in logs]


def on_same_rows(motion, rough) -> tuple:
    """A motion and the same with the noise of its angles once more, with the rows that count in
    both: where either has a joint turn round nobody knows the sign of its speed, and a row that is
    missing in one of them is no noise."""
    known = [p.use & r.use for p, r in zip(motion.pieces, rough.pieces, strict=True)]
    both = ([replace(p, use=u) for p, u in zip(m.pieces, known)] for m in (motion, rough))
    return tuple(replace(m, pieces=tuple(p)) for m, p in zip((motion, rough), both))


def rougher(segment, noise, cutoff: float, rng: np.random.Generator) -> np.ndarray:
    """The angles (n, dof) of a segment with their noise once more.

    White noise of RMS `noise` (dof,) in the middle of the log and elsewhere as much more or less
    as third differences say: stamps that jitter make it grow with the speed. Nowhere more than
    these themselves, as a log may stand through its middle. Of an angle that its
    encoder rounds, what rounding makes of the smoothed angle, and of the noise before it, on a grid
    shifted by a random part of its grain: in slow motion that is no white noise.

    Args:
        cutoff: [Hz], `hardly_moving`: at a steady speed what rounding makes is a tone, which must
            not pass for motion.
    """
    q = segment.q
    if len(q) < _FEWEST:
        return q.copy()
    local = running(_by_window(_third(q), segment.step), 5, "median", "edge")
    middle = _usual(local, _HELD * np.ptp(q, axis=0))
    at = np.linspace(0, len(q) - 1, len(local) + 1)
    at = 0.5 * (at[1:] + at[:-1])
    size = local * np.minimum(noise / np.maximum(middle, 1e-300), 1.0)
    size = np.stack([np.interp(np.arange(len(q)), at, one) for one in size.T], axis=1)
    out = q + size * rng.normal(size=q.shape)
    low = Gaussian(min(cutoff, HIGHEST / segment.step), segment.step)
    for j, grain in enumerate(grains(q)):
        if grain:
            before = np.sqrt(max(noise[j] ** 2 - grain**2 / 12.0, 0.0)) * rng.normal(size=len(q))
            truly = low(q[:, j]) + grain * rng.uniform()
            out[:, j] = q[:, j] + grain * np.round((truly + before) / grain) - truly
    return out


def hardly_moving(cutoff: float, band: float) -> float:
    """The frequency [Hz] above which angles whose motion has such a band hold hardly any of it, at
    most a cutoff."""
    return min(cutoff, max(MOTION * band, _DRIFT))


def grains(q) -> np.ndarray:
    """(dof,) what angles q (n, dof) are rounded to, zero where they are not."""
    out = np.zeros(q.shape[1])
    for j, every in enumerate(np.abs(np.diff(q, axis=0)).T):
        steps = every[every > 1e-9 * np.ptp(q[:, j])]
        if len(steps) <= _FEWEST:
            continue
        grain = steps.min()
        for most in _COUNTS:  # the smallest step is one, rounded again by its file; many tell it
            few = steps[steps < (most + 0.5) * grain]
            grain = few.sum() / np.round(few / grain).sum()
        # of any other numbers one in ten comes that near to a count
        near = np.abs(few / grain - np.round(few / grain)) < _NEAR
        # steps that are all alike are a steady speed
        usual = np.unique(np.round(every / grain), return_counts=True)[1].max() / len(every)
        if len(few) > _FEWEST and np.mean(near) > 0.99 > usual:
            out[j] = grain
    return out
