"""What a diagnosis looks at: a model settled on the motion of logs, and its least squares."""

from ..blocks import by_block
from .design import Design, Sums, designed, instrumented, summed
from .falls import falls
from .joining import (
    COMPARED,
    allowed,
    around,
    as_fitted,
    even,
    joined,
    shapes_in,
    shapes_of,
    weighed,
)
from .laws import law
from .losses import losses, slow_losses, taken, taken_where_held, took
from .opened import elsewhere, first_view, too_short
from .overlap import alike, holds, slow_part
from .singles import greatest
from .strength import strength
from .view import View, looked_at

__all__ = [
    "COMPARED",
    "Design",
    "Sums",
    "View",
    "alike",
    "allowed",
    "around",
    "as_fitted",
    "by_block",
    "designed",
    "elsewhere",
    "even",
    "falls",
    "first_view",
    "greatest",
    "holds",
    "instrumented",
    "joined",
    "law",
    "looked_at",
    "losses",
    "shapes_in",
    "shapes_of",
    "slow_losses",
    "slow_part",
    "strength",
    "summed",
    "taken",
    "taken_where_held",
    "too_short",
    "took",
    "weighed",
]
