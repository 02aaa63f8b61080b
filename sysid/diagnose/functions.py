"""The unknown as a candidate: does a function of the motion, a product of two, take what a model
leaves of a joint? Asked as every effect is, by the same statistic and against the same null."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import flexible
from ..view import View
from . import null
from .projected import made


@dataclass(frozen=True)
class Function:
    """Stands where a candidate does: a function of some variables."""

    variables: str
    blows: bool = False


def law(view: View, j: int) -> flexible.Law:
    """The function of the motion that stands out most of what a view's model leaves of joint j, as
    blocks alone tell: of a thousand slow functions one meets what a spectrum misses of slow noise.
    """
    use, joint = view.rows.use[:, j].astype(bool), view.model.robot.joints[j]
    asked, groups = flexible.products(view.variables, joint, use, view.rows.piece, view.step), []
    for words, values in asked:
        columns = np.ascontiguousarray(values.T)[:, None, :, None]  # the angles' noise adds nothing
        groups += made(view, [(Function(word), {}) for word in words], [j], columns, columns)
    found = null.statistics(groups)
    if not np.isfinite(found).any():
        return flexible.Law(1.0, "", 0.0)
    best = groups[k := int(np.nanargmax(found))]
    chance = null.chance(found[k], null.maxima(groups, np.random.default_rng(j), draws=4000))
    return flexible.Law(chance, best.candidate.variables, max(best.taken, 0.0))
