"""What a diagnosis looks at: a model settled on the motion of logs, and its least squares."""

from .design import Design, Sums, by_block, designed, instrumented, summed
from .joining import COMPARED, allowed, around, joined, shapes_in, shapes_of, weighed
from .laws import law
from .losses import losses, slow_losses, taken, took
from .overlap import makes, part_taken, slow_part
from .singles import greatest
from .view import View, elsewhere, first_view, looked_at, too_short

__all__ = [
    "COMPARED",
    "Design",
    "Sums",
    "View",
    "allowed",
    "around",
    "by_block",
    "designed",
    "elsewhere",
    "first_view",
    "greatest",
    "instrumented",
    "joined",
    "law",
    "looked_at",
    "losses",
    "makes",
    "part_taken",
    "shapes_in",
    "shapes_of",
    "slow_losses",
    "slow_part",
    "summed",
    "taken",
    "too_short",
    "took",
    "weighed",
]
