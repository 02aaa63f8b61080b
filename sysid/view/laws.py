"""The unknown as a candidate: does a function of the motion, a product of two, take what a model
leaves of a joint?"""

from __future__ import annotations

import numpy as np

from .. import flexible
from .singles import greatest
from .view import View


def law(view: View, j: int, more: View | None = None) -> flexible.Law:
    """The function of the motion that stands out most of what a view's model leaves of joint j.

    Args:
        more: the same model on other logs, where the function must hold as well.
    """
    views = [one for one in (view, more) if one is not None]
    over = lambda pick: np.concatenate([pick(one) for one in views])  # noqa: E731
    last = view.rows.piece.max(initial=0)
    piece = np.concatenate([one.rows.piece + k * (last + 1) for k, one in enumerate(views)])
    known = {name: over(lambda one: one.variables[name]) for name in view.variables}  # noqa: B023
    rest = view.model.robot.joints[j], over(lambda one: one.rows.use[:, j]).astype(bool), piece
    asked = lambda: flexible.products(known, *rest, view.step)  # noqa: E731
    found = greatest(views, j, asked, np.random.default_rng(j))
    if found is None:
        return flexible.Law(1.0, "", 0.0)
    return flexible.Law(found.chance, found.words, found.share)
