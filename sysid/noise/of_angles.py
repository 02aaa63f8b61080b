"""What the noise of the angles makes of a predicted torque: the part of a residual's noise whose
spectrum is known."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..log import Log
from ..lowpass import angle_noise, band, hardly_moving, noisier, widest
from ..motion import Motion
from ..prediction import Prediction, predict
from ..preprocess import prepare

_DRAWS = 8  # where stamps jitter: how large their errors are differs from row to row
_MOST = 1_000_000  # draws times rows, for memory


@dataclass(frozen=True)
class OfAngles:
    """torque (draws, n, dof) [N m or N] over the core of each piece: what the angles' noise, drawn
    again, adds to the torque that a fit predicts, beside the measured one. band: [Hz] below which
    the logs' motion stays. known (n, dof) of each: rows that count in the log and in all draws, so
    that none turns a joint's speed round."""

    torque: list[np.ndarray]
    band: float
    known: Sequence[np.ndarray] = ()

    def of(self, pieces: Sequence[int]) -> "OfAngles":
        """The same of some pieces, by their numbers."""
        known = [self.known[k] for k in pieces] if len(self.known) else ()
        return replace(self, torque=[self.torque[k] for k in pieces], known=known)

    def squares(self) -> np.ndarray:
        """(dof,) its mean square over the rows that are known."""
        sums = sum((v**2 * use).mean(0).sum(0) for v, use in zip(self.torque, self.known))
        return sums / np.maximum(sum(use.sum(0) for use in self.known), 1)


def of_angles(
    logs: Sequence[Sequence[Log]], motions: Sequence[Motion], told: Sequence[Prediction], spec, of
) -> OfAngles:
    """What the angles' noise, drawn again, adds to each piece of the prepared logs.

    Derivatives make what is white on an angle anything but white in the torque, stamps that jitter
    make it follow the speed, and a filter cuts it off: all of it is carried through as the log is.
    Its shape is known so; its size only as well as the angles tell it.

    Args:
        logs: of each part. motions: the same, prepared with `spec`. told: what a model predicts of
            these. of: (model, x (size,)) that does.

    Source: Cook & Stefanski 1994 (simulation extrapolation).
    """
    rng, bands = np.random.default_rng(0), [band(part) for part in logs]
    cutoffs = [widest(part, known=own) for part, own in zip(logs, bands)]
    jitter = False

    def made(number: int) -> np.ndarray:
        nonlocal jitter
        part, plain, cutoff = logs[number], motions[number], cutoffs[number]
        slow = hardly_moving(cutoff, bands[number])
        noisy = noisier(part, lambda s: angle_noise(s, cutoff), slow, rng)
        jitter |= any(s.clock is not None for log in noisy for s in log.segments)
        found = predict(*of, prepare(noisy, spec, plain.joints))
        known[number] = known[number] & _use(found)
        # a clock that is late shifts the measured torque as well
        before, after = (one.predicted - one.measured for one in (told[number], found))
        return after - before

    known = [_use(one) for one in told]
    draws = [[made(number)] for number in range(len(logs))]
    rows = sum(len(first) for (first,) in draws)
    for _ in range(min(_DRAWS, _MOST // max(rows, 1)) - 1 if jitter else 0):
        for number, own in enumerate(draws):
            own.append(made(number))
    out, use = [], []
    for own, rows, plain in zip(draws, known, motions):
        ends = np.cumsum([piece.samples for piece in plain.pieces])[:-1]
        out += np.split(np.stack(own), ends, axis=1)
        use += np.split(rows, ends)
    return OfAngles(out, max(bands), use)


def _use(told: Prediction) -> np.ndarray:
    """(n, dof) whether rows count."""
    return np.ones(told.predicted.shape, dtype=bool) if told.use is None else told.use
