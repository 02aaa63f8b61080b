"""The noise floors of a motion's pieces under what a model predicts of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .floor import NoiseFloor, floors
from .of_angles import OfAngles

_SIZES = ("rms", "std", "low", "high", "about")


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


def filtered(found: Sequence[NoiseFloor], smoother) -> list[NoiseFloor]:
    """Floors as a fit sees them that filters torque: of white noise, what comes through."""
    if smoother is None:
        return list(found)
    impulse = np.zeros(20 * smoother.reach + 1)
    impulse[len(impulse) // 2] = 1.0
    gain = float(np.sqrt(np.sum(smoother(impulse) ** 2)))

    def through(floor: NoiseFloor) -> NoiseFloor:
        values = {name: getattr(floor, name) for name in _SIZES}
        scaled = {name: None if v is None else v * gain for name, v in values.items()}
        return replace(floor, **scaled, detail=f"{floor.detail}; carried through the fit's filter")

    return [through(floor) for floor in found]
