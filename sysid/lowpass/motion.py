"""Logs as a motion under one low-pass on both sides, and the band that it asks for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..clock_jumps import without_jumps
from ..events import Event, mended, usable, with_clock
from ..gaussian import HIGHEST, Gaussian
from ..log import Log
from ..motion import Motion, Piece
from ..nonnegative import least_squares
from ..outliers import BURST
from ..preprocess import assembled, share_left_out, unused_of, without_events
from ..running import running
from ..smoother import differences
from ..standstill import standstill_speed, turns, without_standstill
from .angles import noise_of

LEAST = 15.0  # Hz: where friction's laws and ripple still show, several times what an arm moves at
_MOTION = 4.0  # and this many times the motion's own bandwidth, if that is more
_SHARE = 0.25  # of the residual's power may be made by the angles' noise at the end of the band
# the angles' own low-pass, as a multiple of the cutoff: derivatives need some, laws of motion none
_ANGLES = 4.0
# Laws are evaluated at this many samples a cycle of the cutoff: what is steeper than that, friction
# at a reversal, is left out anyway.
_SAMPLES_PER_CYCLE = 16.0
_ROWS_PER_CYCLE = 6.67  # 100 Hz at 15 Hz
# The mean of so many frequencies of white noise is so far above its own in one of fifty thousand
_TOGETHER, _ABOVE = 9, 3.0
_SELDOM = 0.05  # of an octave
MOST_ROWS = 12_000


def lowpassed(
    logs: Sequence[Log], joints: tuple[str, ...], cutoff: float, *, known: float | None = None
) -> Motion | None:
    """Logs as a motion under one low-pass on both sides; None where they are too short for it.

    Args:
        known: their `band`, where it is at hand.
    """
    pieces: list[Piece] = []
    sights, steps = list[int](), list[float]()  # rows, seconds
    for number, log in enumerate(logs):
        for segment in log.segments:
            # spikes are mended before low-passes spread them; of the rest, rows see what these see
            clean = replace(segment, tau=mended(segment, log.events, joints))
            if (piece := _piece(number, log, clean, cutoff)) is not None:
                seen = _sight(piece, segment.step)
                sights.append(math.ceil(seen / piece.step))
                steps.append(segment.step)
                events = with_clock(log.events, segment)
                pieces.append(without_events(piece, events, joints, seen, seen))
    if not pieces:
        return None
    disturbed = share_left_out(pieces)
    pieces = [without_jumps(*each) for each in zip(pieces, steps)]
    threshold = standstill_speed(pieces)
    # where the speed changes its sign between two samples, the angles' noise says in which:
    # friction's jump is as uncertain
    still = [np.where(turns(piece.qd), np.inf, threshold) for piece in pieces]
    pieces = [without_standstill(*each) for each in zip(pieces, still, sights)]
    motion = assembled(joints, pieces, unused=unused_of(logs))
    events = tuple(event for log in logs for event in log.events)
    own_band = band(logs) if known is None else known
    return replace(motion, events=events, disturbed=disturbed, band=own_band)


def widest(logs: Sequence[Log], *, known: float | None = None) -> float:
    """Cutoff [Hz] that the motion itself asks for: several times the frequency below which its
    speeds stay.

    Args:
        known: their `band`, where it is at hand.
    """
    return max(LEAST, _MOTION * (band(logs) if known is None else known))


def band(logs: Sequence[Log]) -> float:
    """The frequency [Hz] below which all joints' speeds stay, noise and knocks aside; zero where
    nothing moves."""
    bands, every = [], ((s, log.events) for log in logs for s in log.segments if len(s.t) > 50)
    for segment, events in every:
        speed = _calm(segment, events)
        speed = speed[:, np.ptp(segment.q, axis=0) > 1e-3 * np.ptp(segment.q, axis=0).max()]
        if not speed.size:
            continue
        power = np.abs(np.fft.rfft(speed * np.hanning(len(speed))[:, None], axis=0)) ** 2
        sums = [np.cumsum(_without_noise(one)) for one in power.T]
        if all(one[-1] > 0 for one in sums):
            # the first frequency below which 99 % stand: less the noise, sums rise and fall
            last = max(int(np.argmax(one >= 0.99 * one[-1])) for one in sums)
            bands.append(last / (len(speed) * segment.step))
    return float(np.median(bands or [0.0]))


def _calm(segment, events: Sequence[Event]) -> np.ndarray:
    """What angles change by from sample to sample (n - 1, dof), straight through knocks."""
    speed, t = np.diff(segment.q, axis=0), segment.t[1:]
    knocks = [event for event in events if event.kind == "knock"]
    good = usable(t, ("any",), knocks, torque=BURST)[:, 0]
    if good.any() and not good.all():
        for values in speed.T:
            values[~good] = np.interp(t[~good], t[good], values[good])
    return speed


def _without_noise(power: np.ndarray) -> np.ndarray:
    """A spectrum (frequencies,) of an angle's differences, less what noise makes of it: white noise
    on the angle grows with the square of frequency, stamps that jitter make white noise of the
    speed. The upper half of the band, where no arm moves, tells. Nothing is left beyond the first
    octave in which noise is all there is: the lumps that rounding makes far above are no motion."""
    angle = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, len(power))) ** 2
    shape = np.stack([np.ones(len(power)), angle], axis=1)
    upper = slice(len(power) // 2, None)
    scale = max(float(power[upper].max()), 1e-300)
    noise = shape @ least_squares(shape[upper], power[upper] / scale) * scale
    stands = np.concatenate([[0], np.cumsum(running(power, _TOGETHER, "mean") > _ABOVE * noise)])
    first = np.arange(max(1, int(np.argmax(power))), len(power) // 2)
    quiet = np.flatnonzero(stands[2 * first] - stands[first] < _SELDOM * first)
    return (power - noise)[: first[quiet[0]]] if len(quiet) else power - noise


def narrowed(cutoff: float, share: float) -> float:
    """The cutoff at which the angles' noise makes no more than a quarter of the residual's power,
    where at `cutoff` it makes `share`: its density grows with the fourth power of frequency, as
    acceleration does."""
    return cutoff * min(1.0, (_SHARE / max(share, 1e-12)) ** 0.25)


def stride_of(motion: Motion, cutoff: float) -> int:
    """Every how many samples a row is kept: several a cycle of the cutoff, and no more than fit in
    memory."""
    step = float(np.median([piece.step for piece in motion.pieces]))
    fine = max(1, round(1.0 / (step * cutoff * _ROWS_PER_CYCLE)))
    return max(fine, -(-motion.samples // MOST_ROWS))


def _sight(piece: Piece, step: float) -> float:
    """How far [s] to either side a row of a piece sees, of samples `step` seconds apart: the
    low-pass of the angles, a difference of the second order, and then both sides' own."""
    return (
        _angles(piece.smoother.cutoff, step).reach + 1
    ) * step + piece.smoother.reach * piece.step


def _angles(cutoff: float, step: float) -> Gaussian:
    return Gaussian(min(_ANGLES * cutoff, HIGHEST / step), step)


def _as_seen(tau: np.ndarray) -> np.ndarray:
    """Torque (n, dof) with the response of a second difference, whose gain falls off with
    frequency f as 1 - (2 pi f step)^2 / 12."""
    seen = tau.copy()
    seen[1:-1] = (tau[:-2] + 10.0 * tau[1:-1] + tau[2:]) / 12.0
    return seen


def _piece(number: int, log: Log, segment, cutoff: float) -> Piece | None:
    rate = 1.0 / segment.step
    every = max(1, int(rate / (_SAMPLES_PER_CYCLE * cutoff)))
    both = Gaussian(min(cutoff, HIGHEST * rate), segment.step)
    settling = Gaussian(both.cutoff, every * segment.step)
    angles = _angles(cutoff, segment.step)
    edge = angles.reach + 2
    rows = slice(edge, len(segment.t) - edge, every)
    n = len(range(*rows.indices(len(segment.t))))
    if n < 6 * settling.reach + 20:
        return None
    smooth = angles(segment.q, axis=0)
    qd, qdd = differences(smooth, segment.step)
    # what these take of fast motion, and torque kept, would look like a joint that gives
    tau = both.at(angles(_as_seen(segment.tau), axis=0).T, rows).T
    noise = noise_of(segment.q[edge:-edge], smooth[edge:-edge], angles.taken_of_noise, segment.step)
    # copies: views would hold what was made of every sample
    q, qd, qdd = (values[rows].copy(order="K") for values in (smooth, qd, qdd))
    return Piece(
        log=number,
        step=every * segment.step,
        t=segment.t[rows],
        q=q,
        qd=qd,
        qdd=qdd,
        tau=tau,
        measured=segment.tau[rows],
        signals={name: values[rows] for name, values in segment.signals.items()},
        use=None,
        smoother=settling,
        core=slice(settling.reach, n - settling.reach),
        rest=np.zeros(smooth.shape[1]),
        noise=noise,
        source=log.name,
        levels=log.levels,
        clock=segment.spread,
    )
