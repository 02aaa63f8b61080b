"""Jumps of acceleration: where a constant one starts, stops or turns within a few samples.

A filter of the angles spreads such a jump over its window; the torque that makes it is left alone.
There the two sides of the equation of motion do not meet, whatever the model. What a filter does
once it does again: the part of an acceleration that a second pass of it takes away is, of a jump, a
wave that is known, by which the jump is told. How much torque that is, what torque has of such
waves where accelerations have them tells, and no model is needed for it: a spike, cogging, friction
that changes its sign move a torque quickly as well and bend no acceleration.

Source: Tukey 1977 (twicing); Turin 1960 (matched filters).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .clock_jumps import light, spread, within
from .jump_response import JumpResponse, about, in_span, off_a_cubic, overlapping
from .motion import Piece
from .outliers import CHANCE, NORMAL, NOTHING, SHORT, SPIKE, quantum, ratio, runs
from .running import running
from .smoother import Smoother

_TOP = 0.95  # of the largest about it: a jump stands within a few samples of there
_MOST = 0.5  # of the square of what a torque does there, which is a jump's wave
_WHOLLY = 0.99  # of a torque, that is a wave: noise and a filter's edge leave no more
_LATE = 0.03  # s: as far as effects have torque stamped too late or too early
_SUPERPOSED = 3  # jumps within two windows of one, the greatest
_SELDOM = 2.33  # deviations: noise of an acceleration has that sign and size in a row of a hundred
_ROUNDS = 4  # of two jumps within a window the greater hides a part of the other


def jumps(
    pieces: Sequence[Piece], smoothers: Sequence[Smoother], counts: Sequence[np.ndarray]
) -> list[np.ndarray]:
    """Of each piece the rows (n, dof) bool that the filter bends for a joint's torque where an
    acceleration jumps: about each jump that makes an error greater than that torque's noise, until
    less is left beyond than the noise of a single row, or as far as the filter sees. Most of what
    the torque itself does there must be such a wave. Where a joint's torque is bent anywhere, the
    ends of logs, which show half a wave, may be so too.

    Args:
        counts: of each piece the rows (n, dof) bool in which a joint moves and is not disturbed.
    """
    out = [np.zeros(piece.q.shape, dtype=bool) for piece in pieces]
    known: dict[float, JumpResponse | None] = {}
    seen: list[_Seen] = []
    for piece, smoother, moves, found in zip(pieces, smoothers, counts, out):
        if 0 < 6 * smoother.reach < len(piece.t):
            if smoother.step not in known:
                known[smoother.step] = JumpResponse.of(smoother, piece)
            response = known[smoother.step]
            if response and (one := _seen(piece, response, moves, found)):
                seen.append(one)
    for j in range(pieces[0].q.shape[1] if seen else 0):
        rest = np.concatenate([one.rest[one.moves[:, j], j] for one in seen])
        sure = np.concatenate([one.sure[one.moves[:, j]] for one in seen])
        if not len(rest):
            continue
        noise = np.median(np.abs(rest[~sure] if np.sum(~sure) >= SHORT else rest)) / NORMAL
        for step in {one.step for one in seen}:
            alike = [one for one in seen if one.step == step]
            late = _late(alike, j, noise)
            for one in alike:
                one.found[:, j] = _bent(one, j, noise, late)
        if any(one.found[:, j].any() for one in seen):
            for one in seen:
                one.found[:, j] |= one.at_ends(j, noise)
    return out


@dataclass(frozen=True)
class _Seen:
    """Of a piece in which joints move in the rows `moves` (n, dof): the jumps `size` (n, dof) of
    its accelerations, each joint's in units of what noise may be, `limits` (dof,), of joints that
    have any; `every` (n, dof) of all; its torque
    without spikes, `level` (n, dof), and how far it jumps, `told` (n, dof); `rest` (n, dof) of the
    torque beyond the filter's band, as large as white noise in it, as the fit sees it; `found` (n,
    dof), where its bent rows are told.
    """

    response: JumpResponse
    piece: Piece
    moves: np.ndarray
    size: np.ndarray
    every: np.ndarray
    limits: np.ndarray
    level: np.ndarray
    told: np.ndarray
    rest: np.ndarray
    found: np.ndarray

    @property
    def step(self) -> float:
        """From row to row [s]."""
        return self.response.smoother.step

    def at_ends(self, j: int, noise: float) -> np.ndarray:
        """(n,) bool: the rows about a piece's ends, where half a jump's wave does not tell it, a tenth
        of it at most, of an end in which joint j's torque or acceleration leaves a cubic, as smooth
        motion is, by as much as a jump."""
        far = min(self.response.smoother.reach + self.response.near, len(self.level) // 10)
        out = np.zeros(len(self.level), dtype=bool)
        most = self.response.over * self.least(j, noise), self.limits[j]
        for end in (slice(far), slice(-far, None)):
            own = np.stack([self.level[end, j], self.piece.qdd[end, j]])
            out[end] = np.any(off_a_cubic(own) > most)
        return out

    def least(self, j: int, noise: float) -> float:
        """What the fit sees of the noise of joint j's torque, and of what it is rounded to."""
        tau = self.piece.measured[:, j]
        rounded = max(quantum(tau) / np.sqrt(12.0), NOTHING * np.std(tau))
        return max(noise, self.response.kept * rounded)

    @cached_property
    def light(self) -> np.ndarray:
        """(dof,) as of `light`, of the rows in which a joint moves."""
        own = zip(self.piece.measured.T, self.piece.qdd.T, self.moves.T)
        return np.array([light(torque[rows], qdd[rows]) for torque, qdd, rows in own])

    @property
    def sure(self) -> np.ndarray:
        """(n,) bool, where any acceleration jumps."""
        return (np.abs(self.size) > 1.0).any(axis=1)

    @cached_property
    def tops(self) -> tuple[np.ndarray, np.ndarray]:
        """The rows (jumps,) in which accelerations jump, and by how much (jumps, dof). The greatest
        thereabouts is one, and what is left without it may show others.

        Source: Högbom 1974 (CLEAN).
        """
        reach = self.response.near
        near = running(self.sure.astype(float), 2 * reach + 1, "max") > 0.0
        left, at, by = np.where(near[:, None], self.size, 0.0), [], []
        for _ in range(_ROUNDS):
            size = np.linalg.norm(left, axis=1) * near
            top = (size > 1.0) & (size >= _TOP * running(size, 2 * reach + 1, "max"))
            found = [first + int(np.argmax(size[first : last + 1])) for first, last in runs(top)]
            if not found:
                break
            at, by = at + found, by + [*left[found]]
            left = self.response.without(left, found)
        return np.array(at, dtype=int), np.reshape(by, (len(at), self.size.shape[1]))

    @cached_property
    def apart(self) -> np.ndarray:
        """(jumps,) bool: the greatest thereabouts, whose waves share no row."""
        (at, by), size = self.tops, np.zeros(len(self.size))
        np.maximum.at(size, at, np.linalg.norm(by, axis=1))
        most = running(size, 4 * self.response.near + 1, "max")[at]
        return np.linalg.norm(by, axis=1) >= most

    @cached_property
    def about(self) -> tuple[np.ndarray, np.ndarray]:
        """Of each jump `size` (jumps, window, dof) about it, and the accelerations as they jump
        there (jumps, dof), of length one."""
        at, by = self.tops
        along = by / np.linalg.norm(by, axis=1, keepdims=True)
        return about(self.size, at, self.response.near), along

    @cached_property
    def waves(self) -> np.ndarray:
        """(jumps, window) of each the wave about it, of the accelerations as they jump there."""
        return np.einsum("kwj,kj->kw", *self.about)

    def bends(self, j: int, noise: float, lags: range) -> tuple[np.ndarray, np.ndarray]:
        """Of each jump, so many samples later (lags, jumps): by how much, at most, a torque of its
        size is bent, times what the fit sees of the noise of joint j's; zero where its torque has
        no such wave; and how surprising it is that it has."""
        (at, by), reach, response = self.tops, self.response.near, self.response
        waves = self.waves * about(self.moves[:, j].astype(float), at, reach)
        far = max(-lags.start, lags[-1])
        told = about(self.told[:, j] * self.moves[:, j], at, reach + far)
        told = np.lib.stride_tricks.sliding_window_view(told, 2 * reach + 1, axis=1)
        told = told[:, far + lags.start : far + lags.stop]
        both, whole = np.einsum("kw,klw->lk", waves, told), np.einsum("klw,klw->lk", told, told)
        own = np.sum(waves**2, axis=1)
        theirs = ratio(both**2, own * whole)
        torque = np.abs(ratio(both, own)) * np.linalg.norm(by, axis=1)
        # a torque in time with an acceleration may be as small as it will
        heavy = torque >= self.light[j] * self.limits[j] * np.abs(by[:, j])
        heavy |= (np.array(lags) == 0)[:, None]
        bends = np.where((theirs > _MOST) & heavy, torque, 0.0)
        # with two degrees of freedom beside a wave that is the chance of as much of one
        chance = np.log((1.0 - _MOST) / (1.0 - np.minimum(theirs, _WHOLLY)))
        return bends, np.where(bends > response.over * noise, chance, 0.0)

    @cached_property
    def near(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """`overlapping` jumps, and the waves (m, window, _SUPERPOSED) of each and its neighbours,
        zero beyond these."""
        (at, by), (sizes, along) = self.tops, self.about
        several, others, number = overlapping(at, by, self.response.near, _SUPERPOSED)
        waves = np.einsum("kwj,ksj->kws", sizes[several], along[others])
        return several, others, waves * (np.arange(_SUPERPOSED) < number[:, None, None])

    def superposed(self, j: int, late: int) -> np.ndarray:
        """(jumps,) as `bends`, of jumps within a window of each other, whose waves joint j's torque
        holds in sum: none of them is most of what it does."""
        (at, by), (several, others, waves), reach = self.tops, self.near, self.response.near
        out = np.zeros(len(at))
        if not len(several):
            return out
        told = about(self.told[:, j] * self.moves[:, j], at[several] + late, reach)
        counts = about(self.moves[:, j].astype(float), at[several], reach)
        theirs = in_span(waves * counts[:, :, None], told)
        most = np.sum(theirs**2, axis=1) > _MOST * np.sum(told**2, axis=1)
        # what it tells of a jump stands where that is
        apart = at[others] - at[several][:, None]
        seen = most[:, None] & (np.abs(apart) <= reach)
        there = np.take_along_axis(theirs, np.clip(apart + reach, 0, 2 * reach), axis=1)
        np.maximum.at(out, others[seen], np.abs(there[seen]))
        if late:  # as in `bends`
            out[out < self.light[j] * self.limits[j] * np.abs(by[:, j])] = 0.0
        return out

    def hidden_by_noise(
        self, j: int, least: float, late: int, known
    ) -> tuple[np.ndarray, np.ndarray]:
        """Rows beside the `known` ones in which joint j's torque jumps by more than `least`, and by
        how much, where its acceleration does so too: there a jump need not outgrow the noise of
        every row, as that of a coarse encoder, but only of one in a hundred."""
        reach, told = (
            self.response.near,
            self.response.without(self.told[:, j] * self.moves[:, j], known),
        )
        size, own = np.abs(told), np.roll(self.every[:, j] * self.moves[:, j], late)
        edge = reach + self.response.smoother.reach
        size[:edge] = size[-edge:] = 0.0  # seen from one side
        top = (size > least) & (size >= _TOP * running(size, 2 * reach + 1, "max"))
        at = np.array([a + int(np.argmax(size[a : b + 1])) for a, b in runs(top)], dtype=int)
        waves, torques = (about(values, at, reach) for values in (own, told))
        both = np.einsum("kw,kw->k", waves, torques)
        theirs = ratio(both**2, np.sum(waves**2, axis=1) * np.sum(torques**2, axis=1))
        seldom = _SELDOM / np.sqrt(2.0 * np.log(self.every.size / CHANCE))
        heavy = size[at] >= self.light[j] * self.limits[j] * np.abs(own[at])
        alike = (own[at] * np.sign(told[at]) > seldom) & (theirs > _MOST) & (both > 0.0)
        return at[alike & heavy], size[at][alike & heavy]


def _seen(
    piece: Piece, response: JumpResponse, moves: np.ndarray, found: np.ndarray
) -> _Seen | None:
    """None where no acceleration jumps and no clock was corrected."""
    of_angle = response.jumps(piece.qdd)
    noise = response.noise * piece.noise
    for j, own in enumerate(moves.T):  # what jumps inflates both
        if own.any():
            noise[j] = min(noise[j], np.median(np.abs(of_angle[own, j])) / NORMAL)
    limits = np.sqrt(2.0 * np.log(of_angle.size / CHANCE)) * noise
    size = ratio(of_angle, limits)
    jumping = (np.abs(size) > 1.0).any(axis=0)
    if not jumping.any() and not piece.clock:
        return None
    level = running(piece.measured, 2 * SPIKE + 1, "median", "edge")  # a spike comes back
    told = response.jumps(level - response.taken(level)) / response.passed
    rest = response.taken(piece.measured) / response.rest * response.kept
    return _Seen(response, piece, moves, size * jumping, size, limits, level, told, rest, found)


def _bent(seen: _Seen, j: int, noise: float, late: int) -> np.ndarray:
    """(n,) bool: the rows about jumps that bend the torque of joint j by more than its noise,
    `late` samples after these. What a jump is in its torque, that torque says."""
    response, tau, piece = seen.response, seen.piece.measured[:, j], seen.piece
    least = seen.least(j, noise)
    (torque,) = seen.bends(j, least, range(late, late + 1))[0]
    torque = np.maximum(torque, seen.superposed(j, late))
    bends = torque > response.over * least
    far = lambda torque: np.searchsorted(-response.beyond, -((least / torque) ** 2))  # noqa: E731
    known = seen.tops[0][bends] + late
    out = within(known, far(torque[bends]), len(tau))
    at, torque = seen.hidden_by_noise(j, response.over * least, late, known)
    out |= within(at, far(torque), len(tau))
    if piece.clock:
        reach, own = int(np.ceil(piece.clock / piece.step)), seen.told[:, j] * seen.moves[:, j]
        inertia = j, seen.light[j]
        at, torque = spread(own, response.over * least, seen.level[:, j], piece.qdd, reach, inertia)
        out |= within(at, far(torque) + reach, len(tau))
    return out


def _late(seen: list[_Seen], j: int, noise: float) -> int:
    """How many samples the waves of joint j's torque come after the jumps that make them; none but
    where so many agree on that as chance hardly makes.

    Args:
        seen: pieces of one rate.
    """
    most = round(_LATE / seen[0].step)
    lags = range(-most, most + 1)
    chance = sum(one.bends(j, noise, lags)[1] @ one.apart for one in seen)
    best = int(np.argmax(chance))
    return lags[best] if chance[best] > chance[most] + np.log(len(lags) / CHANCE) else 0
