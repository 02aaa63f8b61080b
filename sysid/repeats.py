"""Readings that stood still: torque or angles that repeat longer than chance or motion has it."""

from __future__ import annotations

import numpy as np

from .outliers import CHANCE, RESTING, SHORT, quantum, runs

TRAVELS = 0.05  # rad or m: a joint that moves so far needs torque
_GRAINS = 2.5  # quanta: two and the rounding; less is how coarse values move
_MOVING = 1.5  # quanta a sample: what moves as fast repeats no value
_ABOUT = 4  # samples to either side whose speed is what the joint had
# samples and s of torque: a shorter repeat costs less than the rows that a filter's reach would
_FEWEST, _SHORTEST = 4, 0.02
_FEW = 10  # repeats, of which nobody knows how many go on: some, as if it were the share of all
_TWICE = 1.5  # times the speed: half between a step and two
_HELD = 10  # samples at least of an angle that froze and never caught up
_OFTEN = 0.25  # of the rows: what comes more often is the logger's way, not an event


def held_torque(tau, step: float, *, among: int = 1) -> list[tuple[int, int]]:
    """First and last samples of runs in which one joint's torque (n,), `step` [s] apart, is held.

    Where a share p of the samples repeats the one before, the longest of n runs of chance has
    1 + ln(n / chance) / ln(1 / p) samples; p is that of the other runs, or the share of their
    repeats that go on: coarse values that were resampled repeat seldom, but then for long. And a
    run is entered or left by a jump that is none of the values' own grain: a coarse signal leaves
    its crest by one.

    Args:
        among: as of `spikes`.
    """
    n = len(tau)
    size = np.abs(np.diff(tau))
    if n < SHORT or not size.any():
        return []
    every = np.array(runs(size == 0.0), dtype=int).reshape(-1, 2) + [0, 1]  # samples
    long = np.zeros(len(every), dtype=bool)
    length = every[:, 1] - every[:, 0] + 1

    def longer(p: float) -> np.ndarray:
        longest = 1.0 + np.log(n * among / CHANCE) / np.log(1.0 / min(p, 1.0 - 1.0 / n))
        return length > max(longest, _FEWEST, _SHORTEST / step)

    while True:
        p = max(np.sum(length[~long] - 1), 1.0) / max(n - 1 - np.sum(length[long] - 1), 2.0)
        more = long | longer(p)
        if np.array_equal(more, long):
            break
        long = more
    # a level that comes again is a grain's, one that a freeze holds comes once
    short = every[~long]
    if len(short) > 2 * len(np.unique(tau[short[:, 0]])):
        repeats = np.sum(length[~long] - 1)
        on = (repeats - len(short) + _FEW * p) / (repeats + _FEW)
        long &= longer(max(p, on))
    ends = np.concatenate([[0.0], size, [0.0]])
    grain, usual = _GRAINS * quantum(tau), np.median(size[size > 0.0])
    extreme = (tau == tau.min()) | (tau == tau.max())  # what clips gets there at any slope
    least = np.where(extreme[every[:, 0]], grain, max(grain, usual))
    jumps = np.maximum(ends[every[:, 0]], ends[every[:, 1] + 1]) > least
    return [(int(a), int(b)) for a, b in every[long & jumps]]


def rests(q, first: int, last: int, usual: float) -> bool:
    """Whether an angle (n,) stays where it is from `first` to `last`, but for its noise and grain.

    Args:
        usual: the speed [a sample] of the joint that moves most; a small share of it is rest.
    """
    # white noise of deviation s leaves second differences of median 0.6745 sqrt(6) s, and the
    # largest and the least of n values at most 2 sqrt(2 ln n) s apart, in the mean
    own = q[first : last + 1]
    noise = np.median(np.abs(np.diff(q, 2))) / (0.6745 * np.sqrt(6.0))
    apart = 2.0 * np.sqrt(2.0 * np.log(max(len(own), _FEWEST))) + 1.0
    reach = max(RESTING * usual * (last - first), apart * noise, _GRAINS * quantum(q))
    return bool(np.ptp(own) <= reach)


def held_angle(q, but=None) -> list[tuple[int, int]]:
    """First and last samples of runs in which one joint's angle (n,) repeats while the joint moves.

    About the run the joint moves by more than the angle's grain in every sample, so that no repeat
    is due to it; and what it missed meanwhile it makes up in one step, or it had moved as usual and
    is held to the end.

    Args:
        but: (n - 1,) bool, steps of which all else says that nothing came: they say nothing of how
            the joint moves about a run, one alone may be a run, and many runs may come.
    """
    n = len(q)
    step = np.diff(q)
    moves = np.arange(n - 1) if but is None else np.flatnonzero(~but)
    size = np.abs(step)
    if n < SHORT or not size.any():
        return []
    rate = size[moves] / np.diff(moves, prepend=-1)  # what came late moved all the while
    grain, usual = quantum(q), np.sqrt(np.mean(step**2))
    found = []
    for a, b in runs(size == 0.0):  # steps; the samples are a to b + 1
        first, last = np.searchsorted(moves, [a, b + 2])
        before, after = (
            rate[own] for own in (slice(max(first - _ABOUT, 0), first), slice(last, last + _ABOUT))
        )
        held = b - a + 1
        if not len(before) or not before.all() or not after.all() or held >= _OFTEN * n:
            continue
        speed = np.median(before)
        if len(after):
            speed = min(speed, np.median(after))
            caught = size[b + 1] > (0.5 * (held + 1) if held > 1 else _TWICE) * speed
            if (held > 1 or but is not None) and speed > max(_MOVING * grain, RESTING * usual) and caught:
                found.append((a, b + 1))
        elif held >= _HELD and speed > max(_MOVING * grain, 0.5 * usual):
            found.append((a, b + 1))
    often = but is None and sum(b - a + 1 for a, b in found) >= _OFTEN * n
    return [] if often else found
