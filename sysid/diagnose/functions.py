"""The unknown as a candidate: does a function of the motion, a product of two, take what a model
leaves of a joint?"""

from __future__ import annotations

import numpy as np

from .. import flexible
from ..view import View, greatest
from .projected import made


def law(view: View, j: int) -> flexible.Law:
    """The function of the motion that stands out most of what a view's model leaves of joint j."""
    use, joint = view.rows.use[:, j].astype(bool), view.model.robot.joints[j]
    known, rest = view.variables, (joint, use, view.rows.piece, view.step)
    found = greatest(view, j, lambda: flexible.products(known, *rest), np.random.default_rng(j))
    if found is None:
        return flexible.Law(1.0, "", 0.0)
    column = found.column[None, None, :, None]  # the angles' noise adds nothing to it
    groups = made(view, [(None, {})], [j], column, column)
    taken = max((group.taken for group in groups), default=0.0)
    return flexible.Law(found.chance, found.words, max(taken, 0.0))
