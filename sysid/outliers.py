"""How surprising a value is among others of a log; and spikes, samples of torque that stand alone.

One rule gives every level. An exponential tail through a statistic's own median and upper quartile
says how surprising a value z is,

    s = ln 4 + (z - z75) ln 2 / (z75 - z50),    the chance of a greater one being exp(-s),

and the largest of n is out of the ordinary above ln(n / chance). A tenth of the values that is
disturbed cannot move these quantiles far. The tails of noise fall faster than that, so that a clean
log gives fewer events than `CHANCE`; and z75 - z50 is never taken below what white noise gives, for
a statistic of smooth or coarse values may have no spread.
"""

from __future__ import annotations

import numpy as np

from .running import running

CHANCE = 0.01  # of one event of a kind in a clean log
SPIKE = 3  # samples: "one or a few"
FEWEST = 7  # samples that a parabola and its rest need
SHORT = 8 * FEWEST  # samples: a log with fewer has no usual
RESTING = 0.05  # of the usual speed: what is slower rests
_FINER = 10  # times: less is a fine grid of which an angle that turns round meets some levels twice
_LEVELS = 5  # at least that come again, of a torque that is told in steps
_AGAIN = 0.02  # of the values: by chance next to none of a billion are the same
_ABOUT = 4  # steps to either side of a spike that it is compared with
_EDGE = 0.2  # of what stays behind it: what is found is six usual steps, and more than that
_BLOCK = 64  # samples of which a median is the level thereabouts
BURST = 0.05  # s: a knock's time
NORMAL = 0.6745  # median of a Gaussian's absolute values
NOTHING = 1e-3  # share of a torque's spread that disturbs nothing
# z75 - z50 of white noise, from 200 000 samples: 0.42 to 0.53, the wider the pulse the less
_WHITE = 0.53
# how much steeper its tail is from there to one in 10 000, ln(2500) / 3.3 over ln(2) / 0.53
_TAIL = 1.8


def surprise(z, white: float, among=None, tail: float = 1.0) -> np.ndarray:
    """s of values z, from the quantiles of z or of those `among` which they stand; see above.

    Args:
        white: z75 - z50 of white noise. tail: how much steeper than from z50 to z75 its tail is.
    """
    middle, high = np.quantile(z if among is None else among, [0.5, 0.75])
    return np.log(4.0) + (z - high) * tail * np.log(2.0) / max(high - middle, white)


def quantum(values) -> float:
    """The step in which values (n,) are told: the first percentile of the gaps between them, or, of
    values of which many come again, between those that do: a clock that was made even has put
    others between two levels."""
    rounding = 1e-9 * np.abs(values).max(initial=0.0)
    if not rounding > 0.0:
        return 0.0
    grains = np.round(values / rounding)
    # a value that is held comes once: a brake's and a frozen one are two levels of any torque
    fresh = grains[np.append(True, np.diff(grains) != 0.0)]
    own, counts = np.unique(fresh, return_counts=True)
    told, again = [own], counts > 1
    if again.sum() >= _LEVELS and counts[again].sum() > _AGAIN * len(fresh):
        told.append(own[again])
    gaps = [np.diff(one) for one in told if len(one) > 1]
    least, *levels = [np.quantile(one, 0.01) for one in gaps] or [0.0]
    return float(max([least, *(g for g in levels if g > _FINER * least)]) * rounding)


def runs(flags) -> list[tuple[int, int]]:
    """First and last index of every run of true flags (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(flags, dtype=np.int8), [0]])))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2])]


def bursts(s, level: float) -> list[tuple[int, int]]:
    """First and last index of every run of surprises s (n,) above half the level in which one
    stands above it: what is out of the ordinary lasts as long as anything is unusual at all."""
    return [(a, b) for a, b in runs(s > 0.5 * level) if s[a : b + 1].max() > level]


def spikes(tau, *, among: int = 1, grain=None) -> list[list[tuple[int, int]]]:
    """First and last samples of the spikes of each joint's torque (n, dof).

    Of up to `SPIKE` samples that are entered and left by steps of opposite sign, min(|in|, |out|)
    over the usual step: the larger of the log's, of those thereabouts and of half of those next to
    it on either side, of steps the same way before it and after it, and of a share of what stays
    behind it. So the peak of a fast smooth wave, entered and left by steps like those beside it,
    is none, nor is an edge, nor what rises and falls in several steps or goes beyond where it
    stays, as a torque does that breaks a joint away. Where a log has k spikes, chance is allowed k
    times as many: no more than a share `CHANCE` of what is found is false.

    Args:
        among: how many parts its log has that are looked at by themselves, of all of which `CHANCE`
            is. grain: (dof,) steps that are usual at least; by default the torque's own quantum.

    Source: Benjamini & Hochberg 1995.
    """
    n, dof = tau.shape
    if n < SHORT:
        return [[] for _ in range(dof)]
    grain = [quantum(own) for own in tau.T] if grain is None else grain
    found = [pulses for own, least in zip(tau.T, grain) for pulses in _pulses(own, least)]
    hit = [np.zeros(len(z), dtype=bool) for _, z, _ in found]
    while True:
        pairs = zip((z for _, z, _ in found), hit)
        s = [surprise(z, _WHITE, _usual(z[~own]), _TAIL) if len(z) else z for z, own in pairs]
        # ranks of those alone that are high enough at any rank: the others have none
        count, asked = max(sum(map(len, s)), 1), SPIKE * n * dof * among
        lowest = np.log(asked / (CHANCE * count))
        ranked = np.sort(np.concatenate([own[own > lowest] for own in s]))[::-1]
        allowed = CHANCE * np.arange(1, len(ranked) + 1)
        enough = np.flatnonzero(ranked > np.log(asked / allowed))
        least = ranked[enough[-1]] if len(enough) else np.inf
        more = [own | (values >= least) for own, values in zip(hit, s)]
        if all(map(np.array_equal, hit, more)):
            break
        hit = more
    out = []
    for j in range(dof):
        own, taken = [], np.zeros(n, dtype=bool)
        for k in range(SPIKE):
            first, _, alone = found[SPIKE * j + k]
            for a in first[hit[SPIKE * j + k] & alone].tolist():
                if not taken[a : a + k + 1].any():
                    taken[a : a + k + 1] = True
                    own.append((a, a + k))
        out.append(sorted(own))
    return out


def _usual(z):
    """Sizes of pulses, of few of which those that are not there, of no size, are the usual ones."""
    return z if len(z) >= SHORT else np.append(z, np.zeros(SHORT - len(z)))


def _pulses(tau, grain: float):
    """Pulses of tau (n,) of each width: first sample, size over the usual step, is it alone."""
    step = np.diff(tau)
    size = np.abs(step)
    least = max(np.median(size), grain, NOTHING * np.std(tau))
    usual = np.maximum(least, _thereabouts(size))
    away = np.abs(tau - running(tau, 4 * SPIKE + 1, "median", "edge"))
    for width in range(1, SPIKE + 1):
        into = np.arange(_ABOUT, len(tau) - 1 - width - _ABOUT)  # the step into sample into + 1
        into = into[step[into] * step[into + width] < 0.0]
        out = into + width
        beside = np.maximum(_second(size, into, -1), _second(size, out, 1))
        scale = np.maximum(usual[into], 0.5 * beside)  # by which a wave's peak comes to 2 at most
        # what rises and falls in several steps, and what stays, an edge that goes beyond its end
        way = np.sign(step[into])
        slopes = np.minimum(way * step[into - 1], -way * step[out + 1])
        before, after = (_middle(tau, at, to) for at, to in ((into, -1), (out + 1, 1)))
        scale = np.maximum(scale, np.maximum(slopes, _EDGE * np.abs(after - before)))
        z = ratio(np.minimum(size[into], size[out]), scale)
        # what lies between two spikes is nearer to the usual than they are
        inside = np.min([away[into + k] for k in range(1, width + 1)], axis=0)
        yield into + 1, z, inside > np.maximum(away[into], away[out + 1])


def _second(size, at, way: int) -> np.ndarray:
    """The second smallest of the four steps beside each: a spike nearby takes two of them."""
    a, b, c, d = (size[at + way * k] for k in range(1, _ABOUT + 1))
    smaller, larger = (np.minimum(a, b), np.minimum(c, d)), (np.maximum(a, b), np.maximum(c, d))
    return np.minimum(np.maximum(*smaller), np.minimum(*larger))


def _middle(tau, at, way: int) -> np.ndarray:
    """The middle of the samples beside each, this one first."""
    return np.median([tau[at + way * k] for k in range(_ABOUT - 1)], axis=0)


def ratio(values, scale) -> np.ndarray:
    """values / scale, zero where the scale is."""
    out = np.zeros(np.broadcast_shapes(np.shape(values), np.shape(scale)))
    return np.divide(values, scale, out=out, where=scale > 0.0)


def _thereabouts(values) -> np.ndarray:
    """Running median (n,) of values, constant in blocks."""
    blocks = -(-len(values) // _BLOCK)
    padded = np.pad(values, (0, blocks * _BLOCK - len(values)), mode="reflect")
    middle = running(np.median(padded.reshape(blocks, _BLOCK), axis=1), 5, "median", "edge")
    return np.repeat(middle, _BLOCK)[: len(values)]
