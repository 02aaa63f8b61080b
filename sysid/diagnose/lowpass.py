"""Logs -> the domain in which a model is questioned: one low-pass over both sides, standstill left out.

Whatever filter a fit uses, structure that only the filter made must not be taken for physics, and single samples
of noise must not hide it. So angles are lightly smoothed and differentiated, and then torque and every predicted
column go through one and the same zero-phase Gaussian low-pass, whose memory is short and finite; rows where a joint
stands still, where friction is whatever balances the rest, are left out for that joint, widened by what the
filters see of them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..events import mended
from ..log import Log
from ..preprocess import (
    Motion,
    Piece,
    assembled,
    differences,
    share_left_out,
    standstill_speed,
    turns,
    without_events,
    without_standstill,
)

LEAST = 15.0  # Hz: where friction's laws and ripple still show, several times what an arm moves at
_MOTION = 4.0  # and this many times the motion's own bandwidth, if that is more
_SHARE = 0.25  # of the residual's power may be made by the angles' noise at the end of the band
_ANGLES = 4.0  # the angles' own low-pass, as a multiple of the cutoff: derivatives need some, laws of motion none
_SIGHT = 1.25  # how far both low-passes see, as a multiple of the torque's own: the angles' sees a quarter as far
_HIGHEST = 0.3  # of the sampling rate
# Laws are evaluated at this many samples a cycle of the cutoff: what is steeper than that, friction at a reversal, is left
# out anyway.
_SAMPLES_PER_CYCLE = 16.0
_ROWS_PER_CYCLE = 6.67  # 100 Hz at 15 Hz
_WIDTH = 4.0  # standard deviations of the kernel that are kept
MOST_ROWS = 12_000


class Gaussian:
    """A zero-phase low-pass with a Gaussian kernel: -3 dB at the cutoff, no ringing, a finite memory of `reach` samples."""

    kind = "gaussian"

    def __init__(self, cutoff: float, step: float):
        sigma = math.sqrt(math.log(2.0)) / (2.0 * math.pi * cutoff * step)  # samples: |H| = exp(-(2 pi f sigma)^2 / 2)
        self.cutoff, self.step = cutoff, step
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
        """The filtered values (..., n) at some rows of the last axis; the edge's value goes on beyond the edge."""
        n = values.shape[-1]
        kept = np.arange(n)[rows]
        out = np.zeros(values.shape[:-1] + (len(kept),))
        inside = len(kept) and kept[0] >= self.reach and kept[-1] < n - self.reach
        stride = rows.step or 1
        for shift, weight in zip(range(-self.reach, self.reach + 1), self.weights):
            taken = values[..., kept[0] + shift : kept[-1] + shift + 1 : stride] if inside else values[..., np.clip(kept + shift, 0, n - 1)]
            out += weight * taken
        return out

    def __call__(self, values, axis: int = -1) -> np.ndarray:
        """The filtered values, same shape."""
        return np.moveaxis(self.at(np.moveaxis(values, axis, -1), slice(None)), -1, axis)


def lowpassed(logs: Sequence[Log], joints: tuple[str, ...], cutoff: float) -> Motion | None:
    """Logs as a motion under one low-pass on both sides; None where they are too short for it."""
    pieces = []
    for number, log in enumerate(logs):
        for segment in log.segments:
            # spikes are mended before the low-pass, which would spread them; of the rest, rows see what both low-passes see
            clean = replace(segment, tau=mended(segment, log.events, joints)) if log.events else segment
            if (piece := _piece(number, log.name, clean, cutoff)) is not None:
                torque = piece.smoother.reach * piece.step
                angles = _SIGHT * torque + 2.0 * segment.step
                pieces.append(without_events(piece, log.events, joints, angles, torque) if log.events else piece)
    if not pieces:
        return None
    disturbed = share_left_out(pieces)
    threshold = standstill_speed(pieces)
    # where the speed changes its sign between two samples, the angles' noise says in which: friction's jump is as uncertain
    still = [np.where(turns(piece.qd), np.inf, threshold) for piece in pieces]
    reach = [round(_SIGHT * piece.smoother.reach) for piece in pieces]
    motion = assembled(joints, [without_standstill(*each) for each in zip(pieces, still, reach)])
    return replace(motion, events=tuple(event for log in logs for event in log.events), disturbed=disturbed)


def widest(logs: Sequence[Log]) -> float:
    """Cutoff [Hz] that the motion itself asks for: several times the frequency below which its speeds stay."""
    bands = [0.0]
    for segment in (s for log in logs for s in log.segments if len(s.t) > 50):
        speed = np.diff(segment.q, axis=0)
        speed = speed[:, np.ptp(segment.q, axis=0) > 1e-3 * np.ptp(segment.q, axis=0).max()]
        power = np.abs(np.fft.rfft(speed * np.hanning(len(speed))[:, None], axis=0)) ** 2
        power = np.cumsum(np.stack([_without_noise(one) for one in power.T], axis=1), axis=0) if speed.size else power
        if speed.size and (power[-1] > 0).all():
            # at the first frequency below which 99 % stand: noise that was taken off leaves sums that rise and fall
            bands.append(float(np.argmax(power >= 0.99 * power[-1], axis=0).max() / (len(speed) * segment.step)))
    return max(LEAST, _MOTION * float(np.median(bands[1:] or bands)))


def _without_noise(power: np.ndarray) -> np.ndarray:
    """A spectrum (frequencies,) of an angle's differences, less what noise makes of it: white noise on the angle grows with the
    square of frequency, stamps that jitter make white noise of the speed. The upper half of the band, where no arm moves, tells."""
    from scipy.optimize import nnls

    shape = np.stack([np.ones(len(power)), 4.0 * np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, len(power))) ** 2], axis=1)
    upper = slice(len(power) // 2, None)
    scale = max(float(power[upper].max()), 1e-300)
    return power - shape @ nnls(shape[upper], power[upper] / scale)[0] * scale


def narrowed(cutoff: float, share: float) -> float:
    """The cutoff at which the angles' noise makes no more than a quarter of the residual's power, where at `cutoff` it makes
    `share`: its density grows with the fourth power of frequency, as acceleration does."""
    return cutoff * min(1.0, (_SHARE / max(share, 1e-12)) ** 0.25)


def stride_of(motion: Motion, cutoff: float) -> int:
    """Every how many samples a row is kept: several a cycle of the cutoff, and no more than fit in memory."""
    step = float(np.median([piece.step for piece in motion.pieces]))
    fine = max(1, round(1.0 / (step * cutoff * _ROWS_PER_CYCLE)))
    return max(fine, -(-motion.samples // MOST_ROWS))


def _piece(number: int, source: str, segment, cutoff: float) -> Piece | None:
    rate = 1.0 / segment.step
    every = max(1, int(rate / (_SAMPLES_PER_CYCLE * cutoff)))
    both = Gaussian(min(cutoff, _HIGHEST * rate), segment.step)
    settling = Gaussian(both.cutoff, every * segment.step)
    angles = Gaussian(min(_ANGLES * cutoff, _HIGHEST * rate), segment.step)
    edge = angles.reach + 2
    rows = slice(edge, len(segment.t) - edge, every)
    n = len(range(*rows.indices(len(segment.t))))
    if n < 6 * settling.reach + 20:
        return None
    smooth = angles(segment.q, axis=0)
    qd, qdd = differences(smooth, segment.step)
    return Piece(
        log=number, step=every * segment.step, t=segment.t[rows], q=smooth[rows], qd=qd[rows], qdd=qdd[rows], tau=both(segment.tau, axis=0)[rows],
        measured=segment.tau[rows], signals={name: values[rows] for name, values in segment.signals.items()}, use=None, smoother=settling,
        core=slice(settling.reach, n - settling.reach), rest=np.zeros(smooth.shape[1]), noise=_noise(segment.q[edge:-edge], smooth[edge:-edge], angles.taken_of_noise, segment.step),
        source=source,
    )  # fmt: skip


_WINDOW = 0.1  # s


def _noise(q, smooth, taken: float, step: float) -> np.ndarray:
    """RMS (dof,) of white noise on angles q (n, dof): the lesser of what a low-pass took off and of what third differences show,
    as either may hold motion too; each in the middle of all windows of time, as about a reversal there is more."""
    taken_off, differences_ = (_windows(v, step) for v in ((q - smooth) / taken, _third(q)))
    return np.minimum(np.median(taken_off, axis=0), np.median(differences_, axis=0))


def _third(q) -> np.ndarray:
    """Third differences of angles q (n, dof), as large as white noise on them."""
    return np.diff(q, 3, axis=0) / np.sqrt(20.0)  # 1 + 9 + 9 + 1


def _windows(values, step: float) -> np.ndarray:
    """RMS (windows, dof) of values (n, dof) in windows of time."""
    parts = np.array_split(values, max(1, len(values) // max(8, round(_WINDOW / step))))
    return np.sqrt([np.mean(own**2, axis=0) for own in parts])


def rougher(segment, noise, cutoff: float, rng: np.random.Generator) -> np.ndarray:
    """The angles (n, dof) of a segment with their noise once more.

    White noise of RMS `noise` (dof,) in the middle of the log and elsewhere as much more or less as third differences say: stamps
    that jitter make it grow with the speed. Of an angle that its encoder rounds, what rounding makes of the smoothed angle,
    and of the noise before it, on a grid shifted by a random part of its grain: in slow motion that is no white noise.
    """
    from scipy.ndimage import median_filter

    q = segment.q
    local = median_filter(_windows(_third(q), segment.step), size=(5, 1), mode="nearest")
    middle = np.median(local, axis=0)
    at = np.linspace(0, len(q) - 1, len(local) + 1)
    at = 0.5 * (at[1:] + at[:-1])
    profile = np.stack([np.interp(np.arange(len(q)), at, one) for one in (local / np.where(middle > 0, middle, 1.0)).T], axis=1)
    out = q + noise * profile * rng.normal(size=q.shape)
    smooth = Gaussian(min(cutoff, _HIGHEST / segment.step), segment.step)(q, axis=0)
    for j, grain in enumerate(grains(q)):
        if grain:
            before = np.sqrt(max(noise[j] ** 2 - grain**2 / 12.0, 0.0))
            truly = smooth[:, j] + grain * rng.uniform()
            out[:, j] = q[:, j] + grain * np.round((truly + before * rng.normal(size=len(q))) / grain) - truly
    return out


def grains(q) -> np.ndarray:
    """(dof,) what angles q (n, dof) are rounded to, zero where they are not."""
    out = np.zeros(q.shape[1])
    for j, steps in enumerate(np.abs(np.diff(q, axis=0)).T):
        steps = steps[steps > 1e-9 * np.ptp(q[:, j])]
        counts = steps / steps.min() if len(steps) else np.zeros(1)
        # files round the rounded: to a hundredth of a grain, by chance one in fifty would pass
        if len(steps) > 50 and np.mean(np.abs(counts - np.round(counts)) < 0.01 * np.maximum(counts, 1.0)) > 0.99 and np.mean(counts < 50) > 0.5:
            out[j] = np.median(steps / np.round(counts))
    return out
