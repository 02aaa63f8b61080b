"""Whether a model carries over from the logs that trained it to those that test it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import blocks
from .estimate import Fit
from .prediction import Prediction
from .thinning import MOST

_CLEAR = 3.0  # standard errors: one in some hundred joints would be told by chance
_WORTH = 0.1  # of the training error: what a noise floor may be in doubt by


@dataclass(frozen=True)
class Transfer:
    """A joint's RMS on the test logs over that on the training logs, with its standard error (NaN where blocks are too few).

    spans: (logs,) how long each training log is [s].
    """

    joint: str
    ratio: float
    se: float
    spans: tuple[float, ...]

    @property
    def fails(self) -> bool:
        """Whether the error on the test logs is clearly and by a part worth having the greater."""
        return self.ratio - 1.0 > max(_CLEAR * self.se, _WORTH)

    @property
    def says(self) -> str:
        """The sentence; empty where the model carries over, or nothing tells."""
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


def transfers(fit: Fit) -> list[Transfer]:
    """Test error against training error, joint by joint.

        ratio = sqrt(mean r_test^2 / mean r_train^2)

    Residuals of a log are alike over time: both means are judged over blocks of it, several times as long as their memory,
    by leaving one out (jackknife).
    """
    train, test = (fit.predictions[part].thinned(MOST) for part in ("train", "test"))
    spans = tuple(float(np.ptp(train.t[train.log == number])) for number in np.unique(train.log))
    parts = [(part, part.residual) for part in (train, test)]
    out = []
    for j, joint in enumerate(fit.joints):
        (first, one), (second, two) = (_level(part, left[:, j], j) for part, left in parts)
        ratio = float(np.exp(second - first)) if np.isfinite(first) and np.isfinite(second) else float("nan")
        out.append(Transfer(joint, ratio, ratio * float(np.hypot(one, two)), spans))
    return out


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
