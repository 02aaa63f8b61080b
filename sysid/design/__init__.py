"""The next motion to log: the most informative within the limits, or the one that separates suspects.

fourier.py      motions: sums of harmonics, at rest at both ends
limits.py       positions, speeds, accelerations, jerks, torques, clearance, floor
collision.py    how close links come to each other
columns.py      what parameters do to an instant's torque, and how that changes with the motion
information.py  log det M of a motion, and its slope
solve.py        linear programs within a trust region, several starts
promise.py      deviations now and after, and which suspects will be told apart
designed.py     all of it on one page
folder.py       the files
"""

from .designed import Design, design
from .folder import document, write
from .limits import read as read_limits

__all__ = ["Design", "design", "document", "read_limits", "write"]
