"""A user's formula -> a torque effect: `a*sin(3*q) + b*qd**3` on the joints that it is given.

`text` parses and checks it, `words` finds mistyped names in it, `ranges` works out where the values
inside it can be found, `effect` makes columns of it.
"""

from .effect import Formula
from .text import Parsed, parse
from .words import FUNCTIONS, VARIABLES

__all__ = ["FUNCTIONS", "VARIABLES", "Formula", "Parsed", "parse"]
