"""The next motion to log: the most informative within its limits, or one that separates suspects.

fourier.py      motions: sums of harmonics, at rest at both ends, with maneuvers after them
maneuvers.py    ladders of constant speeds, slow reversals, poses, chirps
limits.py       positions, speeds, accelerations, jerks, torques, clearance, floor
links.py        what links look like
spheres.py      which of them may be near at all
collision.py    how close they come to each other along a motion
columns.py      what parameters do to an instant's torque, and how that changes with the motion
suspects.py     what effects that a model may lack would add along a motion
noise.py        how quiet and how large torques are
information.py  what a motion is worth: log det M, evidence between suspects, and its slope
problem.py      a motion against its limits, and how far it must shrink
linear_program.py  the best step within many limits
bodies.py       sums of the bodies' columns, and their slopes
slopes.py       sums of all columns, and their slopes
solve.py        linear programs within a trust region
search.py       several starts in several processes
spectrum.py     the noise that a fit's residual tells, and what it makes of a fit
likely_prior.py how near to the URDF's the logs make bodies likeliest to be
promise.py      deviations now and after, and which suspects will be told apart
left_open.py    what a diagnosis could not tell apart
basis.py        what a design starts from
designed.py     all of it on one page
result.py       a motion and what it promises
folder.py       the files
"""

from ..callable_module import callable_module
from .designed import design
from .folder import document, write
from .limits import read as read_limits
from .result import Design

callable_module(__name__, "", "design")  # `sysid.design(experiment)`

__all__ = ["Design", "design", "document", "read_limits", "write"]
