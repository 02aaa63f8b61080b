"""Whether a model carries over from the logs that trained it to those that test it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from . import blocks
from .estimate import Fit
from .gaussian import HIGHEST, Gaussian
from .prediction import Prediction
from .thinning import MOST

_CLEAR = 3.0  # standard errors: one in some hundred joints would be told by chance
_MOST = 0.5  # of what is more
_FEWEST, _GAP = 50, 1.5  # rows that tell a mean square; steps
_NEAR = 0.9  # of what a low-pass sees about a row that counts
_WORTH = 0.1  # of the training error: what a noise floor may be in doubt by


@dataclass(frozen=True)
class Transfer:
    """A joint's RMS on the test logs over that on the training logs, with its standard error (NaN where blocks are too few).

    spans: (logs,) how long each training log is [s]. band: [Hz] of the diagnosis' low-pass, above which is little but noise; louder: RMS [N m or N] of what the test logs
    have more of beyond it, where that is most of what they have more of.
    """

    joint: str
    ratio: float
    se: float
    spans: tuple[float, ...]
    band: float = np.inf
    louder: float = 0.0

    @property
    def more(self) -> bool:
        """Whether the error on the test logs is clearly and by a part worth having the greater."""
        return self.ratio - 1.0 > max(_CLEAR * self.se, _WORTH)

    @property
    def noisier(self) -> bool:
        """Whether it is so by noise that is faster than arms move: of a coarse encoder in slow motion, or of accelerations where the
        arm has more inertia."""
        return self.more and self.louder > 0.0

    @property
    def fails(self) -> bool:
        """Whether it is so by what a model may tell."""
        return self.more and not self.noisier

    @property
    def says(self) -> str:
        """The sentence; empty where the errors are alike, or nothing tells."""
        if self.noisier:
            return (
                f"the error on the test logs is {self.ratio:.2f} +- {self.se:.2g} times that on the training logs by what is faster than "
                f"{self.band:.2g} Hz for the most part, as the noise of angles and of accelerations is: the model carries over"
            )
        if not self.fails:
            return ""
        shortest, longest = (f"{end(self.spans):.2g}" for end in (min, max))
        lengths = longest if shortest == longest else f"{shortest} to {longest}"
        many = f"the training logs ({len(self.spans)} of {lengths} s) do"
        one = f"the training log ({longest} s) does"
        return (
            f"{many if len(self.spans) > 1 else one} not carry the model to what is new in the test logs (places, motions, forces): "
            f"its error there is {self.ratio:.2f} +- {self.se:.2g} times as large"
        )  # fmt: skip


def quieter(errors: Mapping[str, float], found: Sequence[Transfer]) -> dict[str, float]:
    """Errors [N m or N] of the test logs without what these have more of than the training logs as noise."""
    louder = {one.joint: one.louder for one in found if one.noisier}
    return {joint: max(e**2 - louder.get(joint, 0.0) ** 2, 0.0) ** 0.5 for joint, e in errors.items()}


def transfers(fit: Fit, band: float | None = None) -> list[Transfer]:
    """Test error against training error, joint by joint.

        ratio = sqrt(mean r_test^2 / mean r_train^2)

    Residuals of a log are alike over time: both means are judged over blocks of it, several times as long as their memory,
    by leaving one out (jackknife).

    Args:
        band: [Hz] of a low-pass above which is little but noise; None: it is not asked what is noise.
    """
    train, test = (fit.predictions[part].thinned(MOST) for part in ("train", "test"))
    spans = tuple(float(np.ptp(train.t[train.log == number])) for number in np.unique(train.log))
    parts = [(part, part.residual) for part in (train, test)]
    slow = [_slow(part, left, band) for part, left in parts] if band else []
    out = []
    for j, joint in enumerate(fit.joints):
        (first, one), (second, two) = (_level(part, left[:, j], j) for part, left in parts)
        told = np.isfinite(first) and np.isfinite(second)
        ratio = float(np.exp(second - first)) if told else float("nan")
        louder = 0.0
        if band and told:
            # beside a gap nobody knows what is slow: both of the same rows
            rows = [one.use[:, j] for one in slow]
            whole, below = (_excess(left, rows) for left in ([left[:, j] for _, left in parts], [one.residual[:, j] for one in slow]))
            louder = float(np.sqrt(whole - below)) if 0.0 < whole and below < _MOST * whole else 0.0
        out.append(Transfer(joint, ratio, ratio * float(np.hypot(one, two)), spans, band or np.inf, louder))
    return out


def _excess(left, rows) -> float:
    """By how much the mean square of what is left (n,) on some rows of the test logs exceeds that on the training logs; NaN of too few."""
    first, second = (float(np.mean(own[use] ** 2)) if use.sum() >= _FEWEST else np.nan for own, use in zip(left, rows))
    return second - first


def _slow(part: Prediction, left, band: float) -> Prediction:
    """What is left (n, dof) without what is faster than a band [Hz], on rows about which nearly all count."""
    use = np.ones(left.shape) if part.use is None else part.use.astype(float)
    out, near = np.zeros(left.shape), np.zeros(left.shape)
    steps = np.diff(part.t)
    for number in np.unique(part.log):
        rows = np.flatnonzero(part.log == number)
        step = float(np.median(np.diff(part.t[rows]))) if len(rows) > 1 else 0.0
        if not step > 0.0:
            continue
        low = Gaussian(min(band, HIGHEST / step), step)
        # a log that was split goes on elsewhere
        for own in np.split(rows, np.flatnonzero(steps[rows[:-1]] > _GAP * step) + 1):
            near[own], out[own] = low(use[own], axis=0), low(left[own], axis=0)
    known = (near > _NEAR) & (use > 0.0)
    return Prediction(part.log, part.t, np.where(known, out / np.maximum(near, _NEAR), 0.0), np.zeros(left.shape), known)


def _level(part: Prediction, left, j: int) -> tuple[float, float]:
    """Logarithm of the RMS of what is left (n,) of joint j, and its standard error."""
    use = part.use[:, j] if part.use is not None else np.ones(len(part.t), dtype=bool)
    square = left**2 * use
    if not square.sum() > 0:
        return float("nan"), float("nan")
    step = float(np.median(np.diff(part.t)))
    memory = blocks.memory(left[:, None], use[:, None], part.log, step)
    number = blocks.numbered(part.t, part.log, memory=memory)
    sums, counts = blocks.summed(number, square), blocks.summed(number, use.astype(float))
    sums, counts = sums[counts > 0], counts[counts > 0]
    if len(sums) < 3:
        return float("nan"), float("nan")
    left, rest = sums.sum() - sums, counts.sum() - counts
    without = 0.5 * np.log(np.maximum(left, 1e-300) / np.maximum(rest, 1.0))
    return 0.5 * float(np.log(sums.sum() / counts.sum())), float(blocks.jackknife(without))
