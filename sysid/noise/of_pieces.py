"""The noise floors of a motion's pieces under what a model predicts of them."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .floor import floors
from .noise_floor import UNSURE, NoiseFloor
from .of_angles import OfAngles
from .repeats import MADE

_SIZES = ("rms", "low", "high", "about")


def floors_of(
    pieces: Sequence, predicted: np.ndarray, *, angles: OfAngles | None = None
) -> tuple[NoiseFloor, ...]:
    """The noise floor of each joint.

    Args:
        pieces: of one or more motions. predicted: (n, dof) torque over their cores, one after the
            other [N m or N]. angles: `of_angles` of the same.
    """
    ends = np.cumsum([piece.samples for piece in pieces])[:-1]
    measured = [piece.measured[piece.core] for piece in pieces]
    residuals = [own - told for own, told in zip(measured, np.split(predicted, ends))]
    use = None if pieces[0].use is None else [piece.use[piece.core] for piece in pieces]
    q, steps = [piece.q[piece.core] for piece in pieces], [piece.step for piece in pieces]
    return floors(residuals, measured, q, steps, use=use, angles=angles)


def filtered(
    found: Sequence[NoiseFloor], smoother, was: np.ndarray, now: np.ndarray
) -> list[NoiseFloor]:
    """Floors as a fit sees them whose torque goes through a filter: of white noise what comes
    through, and what the noise of the angles makes there, which is no white one.

    Args:
        was, now: (dof,) mean squares of what the angles' noise makes of the floors found, and of
            the torque that the fit sees.
    """
    impulse = np.zeros(20 * smoother.reach + 1)
    impulse[len(impulse) // 2] = 1.0
    gain = float(np.sum(smoother(impulse) ** 2))

    def through(floor: NoiseFloor, before: float, after: float) -> NoiseFloor:
        size = lambda v: math.sqrt(gain * max(v**2 - before, 0.0) + after)  # noqa: E731
        known = {name: v for name in _SIZES if (v := getattr(floor, name)) is not None}
        sizes = {name: size(v) for name, v in known.items()}
        told = replace(floor, **sizes, detail=f"{floor.detail}; carried through the fit's filter")
        if not told.rms:
            return told
        # how large the angles' noise is stands in both
        made = MADE * (after - gain * before)
        std = math.hypot(gain * 2.0 * floor.rms * floor.std, made) / (2.0 * told.rms)
        low, high = max(told.rms - 2.0 * std, 0.0), told.rms + 2.0 * std
        if std <= UNSURE * told.rms:
            return replace(told, std=std, low=low, high=high)
        why = f"not determined: the noise of the angles hides that of the torque ({told.detail})"
        return NoiseFloor(None, None, "none", why, low, high, told.rms)

    return [through(*own) for own in zip(found, was.tolist(), now.tolist())]
