"""Logs -> the domain in which a model is questioned: one low-pass over both sides, standstill left
out.

Whatever filter a fit uses, structure that only the filter made must not be taken for physics, and
single samples of noise must not hide it. So angles are lightly smoothed and differentiated, and
then torque and every predicted column go through one and the same zero-phase Gaussian low-pass,
whose memory is short and finite; rows where a joint stands still, where friction may have any
value up to its greatest, are left out for that joint, widened by what the filters see of them.

    motion.py    logs under it, and the band that a motion asks for
    angles.py    the noise of the angles: how large it is, and drawn once more
    calm.py      the motion without it
"""

from ..gaussian import Gaussian
from .angles import MOTION, angle_noise, hardly_moving, noisier, on_same_rows
from .calm import KEPT, calm
from .motion import LEAST, band, lowpassed, narrowed, stride_of, widest

__all__ = [
    "KEPT", "LEAST", "MOTION", "Gaussian", "angle_noise", "band", "calm", "hardly_moving",
    "lowpassed", "narrowed", "noisier", "on_same_rows", "stride_of", "widest",
]  # fmt: skip
