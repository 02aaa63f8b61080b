"""What the noise of the angles makes of a predicted torque: the part of a residual's noise whose
spectrum is known."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..estimate import Fit, predict
from ..log import Log
from ..lowpass import angle_noise, band, rougher, widest
from ..preprocess import prepare


@dataclass(frozen=True)
class OfAngles:
    """torque (n, dof) [N m or N] over the core of each piece: what the angles' noise, drawn once
    more, adds to the torque that a fit predicts. band: [Hz] below which the logs' motion stays."""

    torque: list[np.ndarray]
    band: float


def of_angles(logs: Sequence[Sequence[Log]], spec, fit: Fit) -> OfAngles:
    """What the angles' noise, drawn once more, adds to each piece of the prepared logs.

    Derivatives make what is white on an angle anything but white in the torque, stamps that jitter
    make it follow the speed, and a filter cuts it off: all of it is carried through as the log is.
    Its shape is known so; its size only as well as the angles tell it.

    Args:
        logs: of each part, as prepared with `spec`.

    Source: Cook & Stefanski 1994 (simulation extrapolation).
    """
    rng, out, bands = np.random.default_rng(0), [], []
    for part in logs:
        cutoff = widest(part)
        again = [
            replace(log, segments=tuple(_rougher(s, cutoff, rng) for s in log.segments))
            for log in part
        ]
        plain, noisy = (prepare(own, spec, fit.joints) for own in (part, again))
        told = [predict(fit.model, fit.x, motion).predicted for motion in (plain, noisy)]
        ends = np.cumsum([piece.samples for piece in plain.pieces])[:-1]
        out += np.split(told[1] - told[0], ends)
        bands.append(band(part))
    return OfAngles(out, max(bands))


def _rougher(segment, cutoff: float, rng: np.random.Generator):
    return replace(segment, q=rougher(segment, angle_noise(segment, cutoff), cutoff, rng))
