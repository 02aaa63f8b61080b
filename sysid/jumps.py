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

from .motion import Piece
from .outliers import CHANCE, NOTHING, SHORT, SPIKE, quantum, ratio, runs
from .running import running
from .smoother import Smoother

_TOP = 0.95  # of the largest about it: a jump stands within a few samples of there
_MOST = 0.5  # of the square of what a torque does there, which is a jump's wave
_LATE = 0.03  # s: as far as effects have torque stamped too late or too early
_ROUNDS = 4  # of two jumps within a window the greater hides a part of the other
_ROUNDING = 1e-12  # of what a second pass takes away of a jump by one, squared; of a wave's ends
_NORMAL = 0.6745  # median of a Gaussian's absolute values


def jumps(
    pieces: Sequence[Piece], smoothers: Sequence[Smoother], counts: Sequence[np.ndarray]
) -> list[np.ndarray]:
    """Of each piece the rows (n, dof) bool that the filter bends for a joint's torque where an
    acceleration jumps: about each jump that makes an error greater than that torque's noise, until
    less is left beyond than the noise of a single row, or as far as the filter sees. Most of what
    the torque itself does there must be such a wave.

    Args:
        counts: of each piece the rows (n, dof) bool in which a joint moves and is not disturbed.
    """
    out = [np.zeros(piece.q.shape, dtype=bool) for piece in pieces]
    known: dict[float, _Response | None] = {}
    seen: list[_Seen] = []
    for piece, smoother, moves, found in zip(pieces, smoothers, counts, out):
        if 0 < 6 * smoother.reach < len(piece.t):
            if smoother.step not in known:
                known[smoother.step] = _Response.of(smoother, piece)
            response = known[smoother.step]
            if response and (one := _seen(piece, response, moves, found)):
                seen.append(one)
    for j in range(pieces[0].q.shape[1] if seen else 0):
        own = [one.moves[:, j] for one in seen]
        if not any(np.any(use & one.sure) for use, one in zip(own, seen)):
            continue
        parts = [
            (one.moved[use], one.told[use, j], one.rest[use, j], one.sure[use])
            for use, one in zip(own, seen)
        ]
        moved, torque, rest, sure = (np.concatenate(each) for each in zip(*parts))
        # where a posture has another inertia each jump's own torque says how much
        inertia = np.linalg.lstsq(moved, torque, rcond=None)[0]
        noise = np.median(np.abs(rest[~sure] if np.sum(~sure) >= SHORT else rest)) / _NORMAL
        late = {one.step: 0 for one in seen}
        for step in late:
            alike = [(one.near & use, one) for use, one in zip(own, seen) if one.step == step]
            waves = [(h * (one.jumps @ inertia), h * one.told[:, j]) for h, one in alike]
            late[step] = _late(waves, round(_LATE / step))
        for one in seen:
            one.found[:, j] = _bent(one, j, inertia, noise, late[one.step])
    return out


@dataclass(frozen=True)
class _Seen:
    """Of a piece, whose torque is `tau` (n, dof) and in which joints move in the rows `moves` (n,
    dof): the `jumps` (n, dof) of its accelerations, `limits` (dof,) up to which their noise may be
    all there is, and `moved` (n, dof), those beyond; `told` (n, dof) of its torque; `rest` (n, dof)
    of the torque beyond the filter's band, as large as white noise in it, as the fit sees it;
    `sure` (n,) bool, where any acceleration jumps; `found` (n, dof), where its bent rows are told.
    """

    response: _Response
    tau: np.ndarray
    moves: np.ndarray
    jumps: np.ndarray
    limits: np.ndarray
    moved: np.ndarray
    told: np.ndarray
    rest: np.ndarray
    sure: np.ndarray
    found: np.ndarray

    @property
    def step(self) -> float:
        """From row to row [s]."""
        return self.response.smoother.step

    @cached_property
    def near(self) -> np.ndarray:
        """(n,) bool: rows whose filter sees a jump."""
        return running(self.sure.astype(float), 2 * self.response.near + 1, "max") > 0.0


def _seen(piece: Piece, response: _Response, moves: np.ndarray, found: np.ndarray) -> _Seen | None:
    """None where no acceleration jumps."""
    of_angle = response.jumps(piece.qdd)
    noise = response.noise * piece.noise
    for j, own in enumerate(moves.T):  # what jumps inflates both
        if own.any():
            noise[j] = min(noise[j], np.median(np.abs(of_angle[own, j])) / _NORMAL)
    limits = np.sqrt(2.0 * np.log(of_angle.size / CHANCE)) * noise
    moved = np.where(np.abs(of_angle) > limits, of_angle, 0.0)
    jumping, sure = moved.any(axis=0), moved.any(axis=1)
    if not sure.any():
        return None
    level = running(piece.measured, 2 * SPIKE + 1, "median", "edge")  # a spike comes back
    told = response.jumps(level - response.taken(level)) / response.passed
    rest = response.taken(piece.measured) / response.rest * response.kept
    of_angle, limits = of_angle * jumping, limits * jumping
    return _Seen(response, piece.measured, moves, of_angle, limits, moved, told, rest, sure, found)


def _bent(seen: _Seen, j: int, inertia: np.ndarray, noise: float, late: int) -> np.ndarray:
    """(n,) bool: the rows about jumps that bend the torque of joint j, of a usual inertia (dof,), by
    more than its noise, `late` samples after these. The greatest thereabouts is one, and what is
    left without it may show others.

    Source: Högbom 1974 (CLEAN).
    """
    response, tau, told = seen.response, seen.tau[:, j], seen.told[:, j]
    reach = response.near
    sizes, n = seen.jumps @ inertia, len(told)
    least = max(noise, response.kept * max(quantum(tau) / np.sqrt(12.0), NOTHING * np.std(tau)))
    there = seen.moves[:, j].astype(float)
    near, told = seen.near, _shifted(told, late)
    products = (there * sizes**2, there * told**2, there * sizes * told)
    own, whole, both = (running(each, 2 * reach + 1, "mean") for each in products)
    gain = np.abs(ratio(np.where(both**2 > _MOST * own * whole, both, 0.0), own))
    sizes, out = np.where(near, sizes, 0.0), np.zeros(n, dtype=bool)
    unsure = float(np.linalg.norm(seen.limits * inertia))
    for _ in range(_ROUNDS):
        size = np.abs(sizes)
        top = (size > unsure) & (size >= _TOP * running(size, 2 * reach + 1, "max"))
        top &= gain * size > response.over * least
        at = np.array([a + int(np.argmax(size[a : b + 1])) for a, b in runs(top)], dtype=int)
        if not len(at):
            break
        far = np.searchsorted(-response.beyond, -((least / (gain[at] * size[at])) ** 2))
        out |= _within(at + late, far, n)
        for k, jump in zip(at.tolist(), sizes[at].tolist()):
            low, high = max(0, k - response.memory), min(n, k + response.memory + 1)
            start = low - k + response.memory
            sizes[low:high] -= jump * response.alike[start : start + high - low]
        sizes = np.where(near, sizes, 0.0)
    return out


def _late(parts: list[tuple[np.ndarray, np.ndarray]], most: int) -> int:
    """How many samples a torque's waves come after the jumps that make them, up to some; none but
    where that leaves less than half of what else is not theirs.

    Args:
        parts: of each piece, how far its torque jumps (n,), as accelerations have it and as it is.
    """
    lags = range(-most, most + 1)
    alike = np.square([sum(own @ _shifted(told, lag) for own, told in parts) for lag in lags])
    whole = sum(own @ own for own, _ in parts) * sum(told @ told for _, told in parts)
    best = int(np.argmax(alike))
    return lags[best] if whole - alike[best] < (1.0 - _MOST) * (whole - alike[most]) else 0


def _shifted(values: np.ndarray, by: int) -> np.ndarray:
    """Values (n,) as they are `by` samples later; zero beyond their ends."""
    out = np.zeros_like(values)
    if by < 0:
        out[-by:] = values[:by]
    else:
        out[: len(out) - by] = values[by:]
    return out


def _within(at: np.ndarray, reach: np.ndarray, n: int) -> np.ndarray:
    """(n,) bool: the rows that are less than `reach` (k,) rows from one of `at` (k,)."""
    edges = np.zeros(n + 1, dtype=int)
    np.add.at(edges, np.clip(at - reach + 1, 0, n), 1)
    np.add.at(edges, np.clip(at + reach, 0, n), -1)
    return np.cumsum(edges[:-1]) > 0


@dataclass(frozen=True)
class _Response:
    """What a smoother makes of a jump of an acceleration by one.

    wave (k,): what a second pass takes away of it, over its sum of squares. passed: what `wave`
    sees of a torque's jump by one that was smoothed once. noise: RMS of what `wave` sees of white
    noise of one in the angle; rest: of what a pass takes away of white noise of one; kept: of what
    the fit sees of such noise in torque. near: as of `Blur.reach`. beyond (n,): as of
    `Smoother.bent_beyond`. over: how many times its noise a torque jumps where the filter's error
    within `near` samples is as large as that noise, RMS. alike (2 memory + 1,): what a jump by one
    is told to be before and after.
    """

    smoother: Smoother
    wave: np.ndarray
    passed: float
    noise: float
    rest: float
    kept: float
    near: int
    beyond: np.ndarray
    over: float
    alike: np.ndarray
    memory: int

    @classmethod
    def of(cls, smoother: Smoother, piece: Piece) -> _Response | None:
        """None of a smoother that takes nothing away: a polynomial through as many samples."""
        t, middle, _, bent = smoother.of_a_jump()
        both = piece.smoother is not None
        taken = lambda values: (values - smoother(values))[:, 0]  # noqa: E731
        wave = taken(bent)[middle]
        if not (size := np.sum(wave**2)) > _ROUNDING:
            return None
        jump, pulse = np.heaviside(t, 0.5), (t == 0.0).astype(float)
        passed = taken(smoother(jump))[middle] @ wave / size
        half = len(wave) // 2
        seen = np.flatnonzero(np.abs(wave) > np.sqrt(_ROUNDING) * np.abs(wave).max())
        memory = int(np.abs(seen - half).max())
        wave = wave[half - memory : half + memory + 1] / size
        noise = np.linalg.norm(np.convolve(taken(smoother.differentiate(pulse)[2]), wave))
        rest = np.linalg.norm(taken(pulse))
        kept = float(np.linalg.norm(smoother(pulse))) if both else 1.0
        beyond = smoother.bent_beyond(both=both)[: (2 if both else 1) * smoother.reach]
        over = float(np.sqrt((2 * piece.blur.reach + 1) / beyond[0]))
        alike = np.convolve(wave, wave[::-1]) * size
        return cls(
            smoother, wave, float(passed), float(noise), float(rest), kept, piece.blur.reach,
            beyond, over, alike, 2 * memory,
        )  # fmt: skip

    def jumps(self, values) -> np.ndarray:
        """Of values (n, k) that the filter has seen once: the jump at each row, by what a pass
        takes away where it sees both sides."""
        taken, wave, edge = self.taken(values), self.wave[::-1], self.smoother.reach
        taken[:edge] = taken[-edge:] = 0.0
        return np.stack([np.convolve(own, wave, mode="same") for own in taken.T], axis=1)

    def taken(self, values) -> np.ndarray:
        """What a pass takes away of values (n, k), which go on beyond their ends as they came."""
        edge = self.smoother.reach
        beyond = np.pad(values, ((edge, edge), (0, 0)), mode="reflect", reflect_type="odd")
        return values - self.smoother(beyond)[edge:-edge]
