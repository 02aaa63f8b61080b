"""One effect after another joins the model, each asked anew with all that joined before it. Only
training logs are looked at.

Two effects may hide each other: what one does is noise to the other. Where none stands out, one
that takes much joins on trial; if another stands out with it, and then the first or a third with
that one alone, both are there.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..view import View, alike
from .ask import HIDES, Asked, ask
from .refits import settled
from .steps import Step, rejoined, revised, step_of
from .ties import NEAR, Choice, chosen, price_of

LEVEL = 0.01  # family-wise: how often anything is accused where nothing is there
WORTH = 0.03  # of a joint's squared residual under the low-pass: 1.5 % of its root mean square
_ALONE = 1.645  # standard errors: five per cent, were it the only question
STEPS, _SHORTLIST, _TRIALS = 8, 8, 2


def search(
    view: View, extra=(), *, level: float = LEVEL, worth: float = WORTH, most: int = STEPS,
    tell: Callable[[str, float], None] = lambda stage, share: None,
):  # fmt: skip
    """The effects that join, in order, and the answers under the first model and the last.

    Args:
        level: family-wise. most: steps. worth: least share of a joint's square that one must take.

    Returns:
        (steps, asked first, asked last, what is there and cannot be told from effects elsewhere)
    """
    first_view, steps, open_ = view, list[Step](), list[Choice]()

    def asked_with(step: Step, view: View, before: Asked | None) -> Asked:
        told = step.candidate.told(view.model.robot.joints)
        say = lambda share: tell(f"ask, with {told}", share)  # noqa: E731
        return ask(view, extra, say, before=before, anew=step.changed)

    first = asked = ask(view, extra, lambda share: tell("ask", share))
    for _ in range(most):  # a step may go again: no more rounds than steps
        step = _next(view, asked, level, worth, open_)
        new = [step] if step else _pair(view, asked, level, worth, asked_with)
        if not new:
            break
        joined_ = [*steps, *new]
        steps = revised(first_view, joined_, worth)
        view = steps[-1].after
        kept = step and [s.candidate for s in steps] == [s.candidate for s in joined_]
        asked = asked_with(new[-1], view, asked if kept else None)
    return steps, first, asked, open_


def _next(view: View, asked: Asked, level: float, worth: float, open_: list[Choice]) -> Step | None:
    """The candidate that joins next, None where none is there and worth having.

    What takes much of a residual, by its slopes where it does nothing, under weights of joints that
    lack it and a prior as strong as they ask for, may say so only about where it has settled.
    """
    threshold = asked.threshold(level)
    rivals = _rivals(view, asked, worth)
    hopeful = [k for k, clear in rivals.items() if asked.statistics[clear] > threshold]
    if step := _standing(view, asked, rivals, hopeful, worth, open_):
        return step
    heard = {asked.groups[k].candidate.kind for k in hopeful}
    for k in (k for k in _trials(view, asked) if asked.groups[k].candidate.kind not in heard):
        found = settled(view, asked.groups[k])
        told = found and asked.told(k, found)
        if told and told.statistics[k] > threshold:
            own = {j: j for j in np.argsort(-told.gains).tolist()}
            if step := _standing(view, told, own, [k], worth, open_, told.groups[k].candidate.kind):
                return step
    return None


def _trials(view: View, asked: Asked) -> list[int]:
    """Those by which everything falls much where it settles anew, one of each effect on a joint,
    first who takes most."""
    dof, loss = view.model.robot.dof, np.sum(view.design.residual**2, axis=0)
    left, out = [np.mean(loss[g.candidate.touches(dof)]) for g in asked.groups], dict[tuple, int]()
    for k in np.argsort(-asked.falls, kind="stable").tolist():
        if asked.falls[k] > HIDES * left[k]:
            out.setdefault(asked.groups[k].candidate.key, k)
    return list(out.values())[:_TRIALS]


def _standing(view, asked: Asked, rivals, hopeful, worth: float, open_, trial=None) -> Step | None:
    """The first that joins of those that stand out, by falling gain, each beside its rivals. With
    all else bent to a trial of that kind, it speaks for none where it is ruled out itself."""
    while hopeful:
        top = hopeful[0]
        # whoever takes as much as one that is there may be what is there
        near = [k for k in rivals if asked.gains[k] >= NEAR * asked.gains[top] and k != top]
        short = [k for k in near if alike(view, asked.groups[k], asked.groups[top])]
        short = [top, *short][:_SHORTLIST]
        found = chosen(view, [asked.groups[k] for k in short], np.random.default_rng(1))
        if found and trial in (None, *(m.candidate.kind for m, _ in found.members)):
            # of all that were compared one at least is there, though its sign may forbid its name
            step = step_of(view, min(asked.p(rivals[k]) for k in short), found, worth)
            if step is not None and found.decided:
                return step
            if step is not None:
                open_.append(found)
        hopeful = [k for k in hopeful if k not in short]
    return None


def _rivals(view: View, asked: Asked, worth: float) -> dict[int, int]:
    """Of each candidate that may be worth having, the shape values that take most, by falling gain:
    with those that say best that it is there."""
    own, known = dict[tuple, list[int]](), [(c.effect, c.joint) for c in view.model.coefficients]
    # what rests on few blocks stands out of none, and may be what another one speaks for
    few = np.array([not group.testable for group in asked.groups], dtype=bool)
    for k in np.flatnonzero((~(asked.statistics <= _ALONE) | few) & (asked.gains > 0)):
        group = asked.groups[k]
        # more terms in the place of the model's fewer: only where the log tells each of them
        untold = len(group.sizes) - len(group.c) if group.candidate.begins else 0
        if group.signed and untold <= known.count(group.candidate.key):
            own.setdefault(group.candidate.kind, []).append(k)
    loss, dof, out = np.sum(view.design.residual**2, axis=0), view.model.robot.dof, {}
    for ks in own.values():
        # of those with more terms and with fewer, who takes most once its numbers are paid for
        price = price_of(view, asked.groups[max(ks, key=asked.gains.__getitem__)])
        k = max(ks, key=lambda k: asked.gains[k] - price(asked.groups[k]))  # noqa: B023
        left = loss[asked.groups[k].candidate.touches(dof)]
        # else far from worth having, whatever a refit adds to it
        if asked.gains[k] >= 0.5 * worth * left.min():
            # it is there where any set of values says so that takes about what its best one does
            out[k] = _clearest(asked, ks)
    return dict(sorted(out.items(), key=lambda one: -asked.gains[one[0]]))


def _pair(view: View, asked: Asked, level: float, worth: float, asked_with) -> list[Step] | None:
    """Two effects each of which stands out with the other in the model, first what takes more."""
    for k in _trials(view, asked):
        found = chosen(view, [asked.groups[k]], np.random.default_rng(1))
        trial = found and step_of(view, asked.p(k), found, worth)
        then = trial and asked_with(trial, trial.after, asked)
        if other := then and _next(trial.after, then, level, worth, []):
            (first,) = rejoined(view, [other])
            then = asked_with(first, first.after, asked)
            if last := _next(first.after, then, level, worth, []):
                return rejoined(view, sorted((first, last), key=lambda s: -s.choice.gain.sum()))
    return None


def _clearest(asked: Asked, some: list[int]) -> int:
    """Of groups of one candidate, the one that stands out most of those that take about as much."""
    near = np.array(some)[asked.gains[some] >= NEAR * asked.gains[some].max()]
    return max(near, key=lambda k: np.nan_to_num(asked.statistics[k], nan=-np.inf))
