"""Effects that joined the model one after another, and how they are chosen again together."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..candidates import Candidate
from ..model_parameters import ROBOT
from ..view import View, joined, shapes_in, took, weighed
from .projected import groups_at
from .ties import NEAR, Choice, chosen


@dataclass(frozen=True)
class Step:
    """An effect that joined: the choice, its family-wise p-value, the view before and after, and
    the share (dof,) of each joint's loss that it took."""

    choice: Choice
    p: float
    before: View
    after: View
    shares: np.ndarray

    @property
    def candidate(self) -> Candidate:
        """The head's."""
        return self.choice.head.candidate

    @property
    def changed(self) -> set[int]:
        """Its joint, the robot, and joints whose residual it changed by more than a hundredth."""
        return {ROBOT, self.candidate.joint, *np.flatnonzero(np.abs(self.shares) > 0.01)}


def step_of(view: View, p: float, found: Choice, worth: float) -> Step | None:
    """The step that a choice makes, None where what it takes is not worth having."""
    has = found.worth_having(worth)
    return Step(found, p, view, weighed(found.head.view), found.shares) if has else None


def revised(first: View, steps: list[Step], worth: float) -> list[Step]:
    """Steps, each chosen again among what took nearly as much, now that all others are in the
    model: what acted on the motion then may have spoken for another. What they leave nothing goes.

    Args:
        first: the view before all steps.
    """
    # what came again with more to it has taken the place of what was there
    last = {step.candidate.key: step for step in steps}
    if len(last) < len(steps):
        steps = rejoined(first, [step for step in steps if last[step.candidate.key] is step])
    stirred, seen = steps[-1].changed, list[list]()
    # two that speak for each other would take turns for ever
    while (heads := [step.candidate.key for step in steps]) not in seen:
        seen.append(heads)
        steps, changed = _revised_once(first, steps, worth, stirred)
        stirred |= changed
    return steps


def _revised_once(first: View, steps: list[Step], worth: float, stirred: set[int]):
    """Steps up to the first of the joints `stirred` that is another one now, or goes; and the
    joints that it changed, none where there is no such step."""
    last = steps[-1].after
    for number, step in enumerate(steps[:-1]):
        if step.candidate.joint not in stirred:
            continue
        before, later, own = steps[:number], steps[number + 1 :], step.candidate
        others = [(s.candidate, s.choice.head.shapes) for s in (*before, *later)]
        without = joined(first, *((c, shapes_in(last, c, at)) for c, at in others), like=last)
        groups = groups_at(without, [(m.candidate, m.asked) for m in step.choice.close])
        least = NEAR * max((group.taken for group in groups), default=0.0)
        near = [g for g in groups if g.candidate.key == own.key or g.taken >= least]
        if any(group.candidate is own for group in near):
            found = chosen(without, near, np.random.default_rng(1), {id(own): last})
        else:  # its slopes say nothing here; what it takes does
            gain, shares = took(without, last)
            found = replace(step.choice, gain=gain, shares=shares)
        if found is None or not found.worth_having(worth):
            return rejoined(first, [*before, *later]), step.changed
        if found.head.candidate.key != own.key:
            again = replace(step, choice=found, shares=found.shares)
            return rejoined(first, [*before, again, *later]), step.changed | again.changed
        steps = [*before, replace(step, choice=found), *later]
    return steps, set()


def rejoined(first: View, steps: list[Step]) -> list[Step]:
    """Heads of steps, joined anew from the first whose head, or the view before it, is another."""
    out: list[Step] = []
    for step in steps:
        view = out[-1].after if out else first
        there = {other.candidate.key for other in steps if other is not step}
        step, own = replace(step, choice=step.choice.without(there)), step.candidate
        if step.before is not view or step.after.model.terms[-1] != (own.effect, (own.joint,)):
            after = joined(view, (own, step.choice.head.shapes))
            step = Step(step.choice, step.p, view, weighed(after), took(view, after)[1])
        out.append(step)
    return out
