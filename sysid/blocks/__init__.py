"""Blocks of time, and what is said with them: the one place of the package where standard errors of
correlated rows are made.

Neighbouring rows of a filtered signal say the same thing twice. So rows are summed over blocks of
time that are long against every memory in them (the filter's, the noise's), and blocks are what is
counted, left out and resampled.

Which rows stand together (`numbering`), what blocks tell of coefficients (`coefficients`), how sure
a sum or an estimate is (`deviations`, `redrawn`, and `moderated` where blocks are few), how sure
the parameters of a fit are together (`parameters`), and which model loses least (`rivals`).
"""

from .coefficients import gains, moves, taking_part
from .deviations import (
    LEVERAGE,
    RESTING,
    averaged,
    even,
    evening,
    jackknife,
    many,
    resting,
    shared,
    slope_chance,
    standard_error,
    z_score,
)
from .moderated import UNTOLD, Belief, believed
from .numbering import (
    FEWEST,
    MOST,
    SHORTEST,
    Numbering,
    by_block,
    divided,
    extents,
    folds,
    memory,
    numbered,
    summed,
)
from .parameters import clear, covariance, widening
from .redrawn import chance_among, left_out, normal_scores, ratio_at, redrawn
from .rivals import SAME, chances, confidence_set, price, within_one_error

__all__ = [
    "UNTOLD",
    "Belief",
    "FEWEST",
    "LEVERAGE",
    "MOST",
    "Numbering",
    "RESTING",
    "SAME",
    "SHORTEST",
    "averaged",
    "believed",
    "clear",
    "chance_among",
    "chances",
    "confidence_set",
    "covariance",
    "by_block",
    "divided",
    "even",
    "evening",
    "extents",
    "folds",
    "gains",
    "jackknife",
    "many",
    "left_out",
    "memory",
    "moves",
    "normal_scores",
    "numbered",
    "price",
    "ratio_at",
    "redrawn",
    "resting",
    "shared",
    "slope_chance",
    "standard_error",
    "summed",
    "taking_part",
    "widening",
    "within_one_error",
    "z_score",
]
