"""What a model leaves on the test logs, opened once, and where that is.

held_out.py  the residual of a settled model on the test motion
regions.py   the joints, speeds, angles, times and frequencies that hold most of its square
"""

from .held_out import HeldOut, fallen, taken
from .regions import Failure, failures

__all__ = ["Failure", "HeldOut", "failures", "fallen", "taken"]
