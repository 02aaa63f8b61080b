"""One effect after another joins the model, each asked anew with all that joined before it. Only training logs are looked at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..model import ROBOT
from . import null
from .candidates import Candidate, candidates
from .evidence import Group, gain, groups, groups_at
from .ties import Choice, alike, chosen, joined, losses, weighed
from .view import View

LEVEL = 0.01  # family-wise: how often anything is accused where nothing is there
WORTH = 0.03  # of a joint's squared residual under the low-pass: 1.5 % of its root mean square
_ALONE = 1.645  # standard errors: five per cent, were it the only question
_MOST_STEPS, _SHORTLIST, _NEAR = 8, 8, 0.4


@dataclass(frozen=True)
class Step:
    """An effect that joined: the choice, its family-wise p-value, the view before and after, and the share (dof,) of each
    joint's loss that it took."""

    choice: Choice
    p: float
    before: View
    after: View
    shares: np.ndarray

    @property
    def candidate(self) -> Candidate:
        """The head's."""
        return self.choice.head.candidate


@dataclass(frozen=True)
class Asked:
    """The answer of all candidates under one model: groups, statistics and gains (groups,), null maxima of the groups of each
    joint {joint: (draws,)}."""

    groups: list[Group]
    statistics: np.ndarray
    gains: np.ndarray
    null: dict[int, np.ndarray]

    @cached_property
    def maxima(self) -> np.ndarray:
        """(draws,) the greatest of all groups."""
        return np.max([*self.null.values()], axis=0)

    def p(self, k: int) -> float:
        """Family-wise p-value of a group."""
        return float((1 + np.sum(self.maxima >= self.statistics[k])) / (1 + len(self.maxima)))


def ask(view: View, extra=(), tell: Callable[[float], None] = lambda share: None, *, before: Asked | None = None, anew=None) -> Asked:
    """Every candidate that a view's model lacks.

    Args:
        before: answers under the model that this one grew from. anew: the joints where it changed something: of all others the
            answers stand.
    """
    all_ = candidates(view.model, extra)
    joints = sorted({c.joint for c in all_})
    groups_, statistics, gains, nulls = [], [], [], {}
    for number, joint in enumerate(joints):  # a joint at a time: its columns stand in memory together
        if before is not None and joint not in anew:
            own = [k for k, g in enumerate(before.groups) if g.candidate.joint == joint]
            groups_ += [before.groups[k] for k in own]
            statistics, gains = [*statistics, before.statistics[own]], [*gains, before.gains[own]]
            nulls[joint] = before.null[joint]
        else:
            found = groups(view, [c for c in all_ if c.joint == joint])
            groups_ += found
            statistics, gains = [*statistics, null.statistics(found)], [*gains, np.array([gain(g).sum() for g in found])]
            nulls[joint] = null.maxima(found, np.random.default_rng(0))  # the same signs for all: draws of one residual
        tell((number + 1) / len(joints))
    return Asked(groups_, np.concatenate(statistics), np.concatenate(gains), nulls)


def search(
    view: View, extra=(), *, level: float = LEVEL, worth: float = WORTH, most: int = _MOST_STEPS,
    tell: Callable[[str, float], None] = lambda stage, share: None,
):  # fmt: skip
    """The effects that join, in order, and the answers under the first model and the last.

    Args:
        level: family-wise. worth: least share of a joint's squared residual that an effect must take. most: steps.

    Returns:
        (steps, asked first, last view, what is there and cannot be told from effects elsewhere)
    """
    steps: list[Step] = []
    first_view = view
    open_: list[Choice] = []
    first = asked = ask(view, extra, lambda share: tell("ask", share))
    for _ in range(most):  # a step may go again: no more rounds than steps
        step = _next(view, asked, level, worth, open_)
        if step is None:
            break
        joined_ = [*steps, step]
        steps = revised(first_view, joined_, worth)
        view = steps[-1].after
        anew = _changed(step) if [s.candidate for s in steps] == [s.candidate for s in joined_] else None
        asked = ask(
            view, extra, lambda share, word=step.candidate.name: tell(f"ask, with {word}", share),
            before=asked if anew is not None else None, anew=anew,
        )  # fmt: skip
    return steps, first, view, open_


def _next(view: View, asked: Asked, level: float, worth: float, open_: list[Choice]) -> Step | None:
    """The candidate that joins next, None where none is there and worth having."""
    threshold = np.quantile(asked.maxima, 1.0 - level) if len(asked.groups) else np.inf
    best: dict[tuple, int] = {}
    for k in np.flatnonzero(~(asked.statistics <= _ALONE) & (asked.gains > 0)):
        key = (*asked.groups[k].candidate.key, asked.groups[k].candidate.options)
        if _sign(asked.groups[k]) and (key not in best or asked.gains[k] > asked.gains[best[key]]):
            best[key] = k
    # whoever takes as much as one that is there may be what is there
    rivals = sorted(best.values(), key=lambda k: -asked.gains[k])
    hopeful = [k for k in rivals if asked.statistics[k] > threshold]
    dof = view.model.robot.dof
    while hopeful:
        top = hopeful[0]
        where = set(asked.groups[top].candidate.touches(dof))
        near = [k for k in rivals if asked.gains[k] >= _NEAR * asked.gains[top]]
        # who acts on the same joints, and who takes the same thing through bodies that bend
        short = [
            k for k in near
            if where & set(asked.groups[k].candidate.touches(dof)) or alike(view, asked.groups[k], asked.groups[top])
        ]  # fmt: skip
        short = [top, *(k for k in short if k != top)][:_SHORTLIST]
        found = chosen(view, [asked.groups[k] for k in short], np.random.default_rng(1))
        # of all that cannot be told apart, one at least must be there
        there = {id(asked.groups[k]) for k in hopeful}
        inside = set() if found is None else {id(m.group) for m in (*(m for m, _ in found.members), *found.general)}
        if found is not None and inside & there:
            p = min(asked.p(k) for k in short if id(asked.groups[k]) in inside)
            step = _joined(view, p, found, worth)
            if step is not None and found.decided:
                return step
            if step is not None:
                open_.append(found)
        hopeful = [k for k in hopeful if k not in short]
    return None


def _changed(step: Step) -> set[int]:
    """The joint of a step, the robot as a whole, and the joints whose residual the step changed by more than a hundredth."""
    return {ROBOT, step.candidate.joint, *np.flatnonzero(np.abs(step.shares) > 0.01)}


def revised(first: View, steps: list[Step], worth: float) -> list[Step]:
    """Steps, each chosen again among what it was tied with, now that all the others are in the model: what still acted on the
    motion when it was chosen may have spoken for another. One that the others leave nothing to do goes.

    Args:
        first: the view before all steps.
    """
    # what came again with more to it has taken the place of what was there
    last = {step.candidate.key: step for step in steps}
    if len(last) < len(steps):
        return revised(first, _rejoined(first, [step for step in steps if last[step.candidate.key] is step]), worth)
    if len(steps) < 2:
        return steps
    for number in range(len(steps) - 1):
        step = steps[number]
        if len(step.choice.members) < 2:
            continue
        others = _rejoined(first, [*steps[:number], *steps[number + 1 :]])
        without = others[-1].after
        groups = groups_at(without, [(m.candidate, m.asked) for m, _ in step.choice.members])
        found = chosen(without, groups, np.random.default_rng(1))
        again = None if found is None else _joined(without, step.p, found, worth)
        if again is None:
            return revised(first, others, worth)
        if found.head.candidate.key != step.candidate.key:
            return revised(first, _rejoined(first, [*steps[:number], again, *steps[number + 1 :]]), worth)
        steps = [*steps[:number], replace(step, choice=found), *steps[number + 1 :]]
    return steps


def _rejoined(first: View, steps: list[Step]) -> list[Step]:
    """The heads of steps, joined one after another anew."""
    out: list[Step] = []
    for step in steps:
        view = out[-1].after if out else first
        after = joined(view, step.candidate, step.choice.head.shapes)
        shares = _shares(view, losses(after, view.blocks))
        out.append(Step(step.choice, step.p, view, weighed(after), shares))
    return out


def _joined(view: View, p: float, found: Choice, worth: float) -> Step | None:
    shares = _shares(view, found.head.losses)
    joints = found.head.candidate.touches(view.model.robot.dof)
    if shares[joints].max() < worth or found.gain.sum() <= 0.0:
        return None
    return Step(found, p, view, weighed(found.head.view), shares)


def _shares(view: View, after: np.ndarray) -> np.ndarray:
    base = losses(view, view.blocks).sum(0)
    whole = np.maximum(base + np.sum(view.design.rough_residual**2, axis=0), 1e-300)
    return (base - after.sum(0)) / whole


def _sign(group: Group) -> bool:
    """Whether the coefficients have the signs that the effect allows."""
    if group.candidate.nonlinear:
        free = [s for s in group.candidate.effect.shapes() if s.start is not None]
        return all(not (s.low == 0.0 and c < 0) for s, c in zip(free, group.coefficients))
    linear = group.candidate.effect.coefficients()
    return len(linear) > 1 or all(not (one.lower == 0 and c < 0) for one, c in zip(linear, group.coefficients))
