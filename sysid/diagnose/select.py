"""One effect after another joins the model, each asked anew with all that joined before it. Only
training logs are looked at."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..view import View
from .ask import Asked, ask
from .steps import Step, revised, step_of
from .ties import NEAR, Choice, alike, chosen

LEVEL = 0.01  # family-wise: how often anything is accused where nothing is there
WORTH = 0.03  # of a joint's squared residual under the low-pass: 1.5 % of its root mean square
_ALONE = 1.645  # standard errors: five per cent, were it the only question
_MOST_STEPS, _SHORTLIST = 8, 8


def search(
    view: View,
    extra=(),
    *,
    level: float = LEVEL,
    worth: float = WORTH,
    most: int = _MOST_STEPS,
    tell: Callable[[str, float], None] = lambda stage, share: None,
):
    """The effects that join, in order, and the answers under the first model and the last.

    Args:
        level: family-wise. most: steps. worth: least share of a joint's squared residual that an
            effect must take.

    Returns:
        (steps, asked first, asked last, what is there and cannot be told from effects elsewhere)
    """
    first_view, steps, open_ = view, list[Step](), list[Choice]()
    first = asked = ask(view, extra, lambda share: tell("ask", share))
    for _ in range(most):  # a step may go again: no more rounds than steps
        step = _next(view, asked, level, worth, open_)
        if step is None:
            break
        joined_ = [*steps, step]
        steps = revised(first_view, joined_, worth)
        view = steps[-1].after
        kept = [s.candidate for s in steps] == [s.candidate for s in joined_]
        told = step.candidate.told(view.model.robot.joints)
        say = lambda share, told=told: tell(f"ask, with {told}", share)  # noqa: E731
        asked = ask(view, extra, say, before=asked if kept else None, anew=step.changed)
    return steps, first, asked, open_


def _next(view: View, asked: Asked, level: float, worth: float, open_: list[Choice]) -> Step | None:
    """The candidate that joins next, None where none is there and worth having."""
    threshold = np.quantile(asked.maxima, 1.0 - level) if len(asked.groups) else np.inf
    own: dict[tuple, list[int]] = {}
    for k in np.flatnonzero(~(asked.statistics <= _ALONE) & (asked.gains > 0)):
        if asked.groups[k].signed:
            candidate = asked.groups[k].candidate
            own.setdefault((*candidate.key, candidate.options), []).append(k)
    best = {key: max(ks, key=asked.gains.__getitem__) for key, ks in own.items()}
    # it is there where any set of shape values says so that takes about what its best one does
    clear = {best[key]: _clearest(asked, ks) for key, ks in own.items()}
    # far from worth having, whatever a refit adds to it
    least = 0.5 * worth * np.sum(view.design.residual**2, axis=0)
    dof = view.model.robot.dof
    for key, k in [*best.items()]:
        if asked.gains[k] < least[asked.groups[k].candidate.touches(dof)].min():
            del best[key]
    # whoever takes as much as one that is there may be what is there
    rivals = sorted(best.values(), key=lambda k: -asked.gains[k])
    hopeful = [k for k in rivals if asked.statistics[clear[k]] > threshold]
    while hopeful:
        top = hopeful[0]
        where = set(asked.groups[top].candidate.touches(dof))
        near = [k for k in rivals if asked.gains[k] >= NEAR * asked.gains[top]]
        # who acts on the same joints, and who takes the same thing through bodies that bend
        short = [k for k in near if where & set(asked.groups[k].candidate.touches(dof))]
        short += [
            k for k in near if k not in short and alike(view, asked.groups[k], asked.groups[top])
        ]
        short = [top, *(k for k in short if k != top)][:_SHORTLIST]
        found = chosen(view, [asked.groups[k] for k in short], np.random.default_rng(1))
        if found is not None:
            # of all that were compared one at least is there, though its sign may forbid its name
            step = step_of(view, min(asked.p(clear[k]) for k in short), found, worth)
            if step is not None and found.decided:
                return step
            if step is not None:
                open_.append(found)
        hopeful = [k for k in hopeful if k not in short]
    return None


def _clearest(asked: Asked, some: list[int]) -> int:
    """Of groups of one candidate, the one that stands out most of those that take about as much."""
    least = NEAR * asked.gains[some].max()
    near = [k for k in some if asked.gains[k] >= least]
    return max(near, key=lambda k: np.nan_to_num(asked.statistics[k], nan=-np.inf))
