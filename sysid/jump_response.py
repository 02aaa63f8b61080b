"""The wave that a filter makes of a jump of an acceleration, by which such a jump is told (`jumps`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .motion import Piece
from .smoother import Smoother

_ROUNDING = 1e-12  # of what a second pass takes away of a jump by one, squared; of a wave's ends
_CUBIC = 4  # coefficients
_ONE = 1e-6  # of the largest of their singular values: waves that are one


@dataclass(frozen=True)
class JumpResponse:
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
    def of(cls, smoother: Smoother, piece: Piece) -> JumpResponse | None:
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

    def without(self, values: np.ndarray, at) -> np.ndarray:
        """Values (n, ...) less the waves of jumps at rows, of each what those before it left."""
        left, memory = values.copy(), self.memory
        for k in at:  # of two within a window each may have a part of the other
            if not 0 <= k < len(left):  # torque that is late ends later than the log
                continue
            low, high = max(0, k - memory), min(len(left), k + memory + 1)
            wave = self.alike[low - k + memory : high - k + memory]
            left[low:high] -= np.multiply.outer(wave, left[k].copy())
        return left


def overlapping(
    at: np.ndarray, by: np.ndarray, reach: int, most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of jumps at rows (jumps,) and as large as `by` (jumps, dof) those that have others within
    twice the reach of their waves: their numbers (m,), those of the `most` greatest there (m,
    most), of fewer the last once more, and how many they are (m,)."""
    order, size = np.argsort(at), np.linalg.norm(by, axis=1)
    low = np.searchsorted(at[order], at - 2 * reach)
    high = np.searchsorted(at[order], at + 2 * reach, "right")
    several = np.flatnonzero(high - low > 1)
    found = [order[low[k] : high[k]] for k in several]
    found = [own[np.argsort(-size[own])][:most] for own in found]
    others = [own[np.minimum(np.arange(most), len(own) - 1)] for own in found]
    number = np.array([len(own) for own in found], dtype=int)
    return several, np.reshape(others, (len(several), most)).astype(int), number


def about(values: np.ndarray, at: np.ndarray, reach: int) -> np.ndarray:
    """(k, 2 reach + 1, ...) of values (n, ...) about the rows `at` (k,); zero beyond their ends."""
    rows = at[:, None] + np.arange(-reach, reach + 1)
    inside = (rows >= 0) & (rows < len(values))
    inside = inside.reshape(*inside.shape, *np.ones(values.ndim - 1, dtype=int))
    return np.where(inside, values[np.clip(rows, 0, len(values) - 1)], 0.0)


def in_span(columns: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Of values (m, n) the part (m, n) that their own columns (m, n, k) span."""
    across, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    across = across * (sizes > _ONE * sizes[:, :1])[:, None, :]
    return np.einsum("mnk,ml,mlk->mn", across, values, across, optimize=True)


def off_a_cubic(values: np.ndarray) -> np.ndarray:
    """How far each of values (k, n) goes from one side of its cubic to the other (k,)."""
    if (count := values.shape[1]) <= _CUBIC:
        return np.zeros(len(values))
    basis, _ = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, count), _CUBIC))
    return np.ptp(values - values @ basis @ basis.T, axis=1)
