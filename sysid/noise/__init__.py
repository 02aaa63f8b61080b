"""The noise floor of a joint's torque: the RMS [N m or N] that a perfect model would leave, found
without a perfect model.

    stretches.py         the rows that count, as contiguous runs; the bandwidth of the motion
    motion_functions.py  plain functions of the motion, of which missing effects are made
    pursuit.py           what they explain is taken off the residual
    outliers.py          spikes, bursts and what friction leaves about reversals are taken out
    repeats.py           noise as the scatter between repeats of the motion
    spectrum.py          noise from the spectrum of the rest, weighed over models of its colour
    noise_floor.py       what is known of one joint
    floor.py             all of it, and whether the answer is sure enough to be given
    of_angles.py         what the noise of the angles makes of the torque, drawn again
    of_fit.py            the floors of a fit's joints
    of_pieces.py         the floors of a motion's pieces, and behind a fit's filter
"""

from .floor import floor, floors
from .noise_floor import DOUBT, NoiseFloor, as_of_test
from .of_angles import OfAngles, of_angles
from .of_fit import floors_of_fit
from .of_pieces import filtered, floors_of

__all__ = [
    "DOUBT", "NoiseFloor", "OfAngles", "as_of_test", "filtered", "floor", "floors", "floors_of",
    "floors_of_fit", "of_angles",
]  # fmt: skip
