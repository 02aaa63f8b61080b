"""What a flexible function of the motion takes of a joint's residual, whatever its law.

Linear splines over the joint's angle, speed and time, the same of every other joint, products and
signs, what the load and the speed were a while ago, and random cosines of pairs of variables; all
together one group, held small by a ridge that blocks held apart choose.

The functions (`functions`), what they predict of what they were not fitted on (`ridge`), whether
blocks agree on any small family of them (`agreement`), and what is said of it (`unknown`).

Source: Rahimi & Recht 2007 (random features); Hoerl & Kennard 1970 (ridge).
"""

from .agreement import Agreement, Projection, agreement
from .functions import families
from .unknown import TONE, Unknown, unknown

__all__ = [
    "TONE",
    "Agreement",
    "Projection",
    "Unknown",
    "agreement",
    "families",
    "unknown",
]
