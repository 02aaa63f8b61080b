"""What a diagnosis looks at: a model settled on the motion of logs, and its least squares."""

from .design import Design, Sums, by_block, designed, instrumented, summed
from .laws import law
from .losses import losses, taken
from .singles import greatest
from .view import View, elsewhere, first_view, looked_at, too_short

__all__ = [
    "Design",
    "Sums",
    "View",
    "by_block",
    "designed",
    "elsewhere",
    "first_view",
    "greatest",
    "instrumented",
    "law",
    "looked_at",
    "losses",
    "summed",
    "taken",
    "too_short",
]
