"""What the noise of the angles makes of a predicted torque: the part of a residual's noise whose
spectrum is known."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..log import Log
from ..lowpass import again, angle_noise, band, widest
from ..motion import Motion
from ..prediction import Prediction, predict
from ..preprocess import prepare

_DRAWS = 8  # where stamps jitter: how large their errors are differs from row to row


@dataclass(frozen=True)
class OfAngles:
    """torque (draws, n, dof) [N m or N] over the core of each piece: what the angles' noise, drawn
    again, adds to the torque that a fit predicts, beside the measured one. band: [Hz] below which
    the logs' motion stays."""

    torque: list[np.ndarray]
    band: float


def of_angles(
    logs: Sequence[Sequence[Log]], motions: Sequence[Motion], told: Sequence[Prediction], spec, of
) -> OfAngles:
    """What the angles' noise, drawn once more, adds to each piece of the prepared logs.

    Derivatives make what is white on an angle anything but white in the torque, stamps that jitter
    make it follow the speed, and a filter cuts it off: all of it is carried through as the log is.
    Its shape is known so; its size only as well as the angles tell it.

    Args:
        logs: of each part. motions: the same, prepared with `spec`. told: what a model predicts of
            these. of: (model, x (size,)) that does.

    Source: Cook & Stefanski 1994 (simulation extrapolation).
    """
    rng, out, bands = np.random.default_rng(0), [], []
    clocks = [s.clock for part in logs for log in part for s in log.segments]
    draws = _DRAWS if any(clock is not None for clock in clocks) else 1
    for part, plain, known in zip(logs, motions, told):
        cutoff = widest(part, known=(own_band := band(part)))
        drawn = lambda s: again(s, angle_noise(s, cutoff), cutoff, rng)  # noqa: E731, B023
        made = []
        for _ in range(draws):
            noisy = [replace(log, segments=tuple(map(drawn, log.segments))) for log in part]
            found = predict(*of, prepare(noisy, spec, plain.joints))
            # a clock that is late shifts the measured torque as well
            error = [one.predicted - one.measured for one in (known, found)]
            made.append(error[1] - error[0])
        ends = np.cumsum([piece.samples for piece in plain.pieces])[:-1]
        out += np.split(np.stack(made), ends, axis=1)
        bands.append(own_band)
    return OfAngles(out, max(bands))
