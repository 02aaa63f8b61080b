"""The unknown as a candidate: does a function of the motion, a product of two, take what a model
leaves of a joint?"""

from __future__ import annotations

import numpy as np

from .. import flexible
from ..model import Model
from .singles import greatest
from .view import View


def ripples(model: Model, j: int) -> list[float]:
    """Periods of joint j's own angle in 2 pi rad or m that a model's effects have [1/rad or 1/m]."""
    own = [
        (model.terms[v.term][0], at)
        for v, at in zip(model.shape_values, model.shapes)
        if v.joint == j and v.shape.spacing
    ]
    return [line * k for effect, k in own for line in range(1, effect.lines + 1)]


def law(view: View, j: int, more: View | None = None) -> flexible.Law:
    """The function of the motion that stands out most of what a view's model leaves of joint j.

    Args:
        more: the same model on other logs, where the function must hold as well.
    """
    views = [one for one in (view, more) if one is not None]
    # behind the rows of each view those of its motion with the angles' noise once more
    motions = [own for one in views for own in (one.variables, one.rough_variables)]
    each = lambda pick: [pick(one) for one in views for _ in range(2)]  # noqa: E731
    last = max(one.rows.piece.max(initial=0) for one in views) + 1
    pieces = [own + k * last for k, own in enumerate(each(lambda one: one.rows.piece))]
    use = np.concatenate(each(lambda one: one.rows.use[:, j].astype(bool)))
    known = {name: np.concatenate([own[name] for own in motions]) for name in view.variables}
    rest = (
        view.model.robot.joints[j],
        use,
        np.concatenate(pieces),
        view.step,
        ripples(view.model, j),
    )
    asked = lambda: flexible.products(known, *rest)  # noqa: E731
    found = greatest(views, j, asked, j)
    if found is None:
        return flexible.Law(1.0, "", 0.0)
    return flexible.Law(found.chance, found.words, found.share)
