"""What all candidates answer under one model: statistics, gains, and the null that they share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..candidates import candidates
from ..view import View
from . import null
from .evidence import Group, gain, groups


@dataclass(frozen=True)
class Asked:
    """The answer of all candidates under one model: groups, statistics and gains (groups,), null
    maxima of the groups of each joint {joint: (draws,)}."""

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


def ask(
    view: View,
    extra=(),
    tell: Callable[[float], None] = lambda share: None,
    *,
    before: Asked | None = None,
    anew=None,
) -> Asked:
    """Every candidate that a view's model lacks.

    Args:
        before: answers under the model that this one grew from. anew: the joints where it changed
            something: of all others the answers stand.
    """
    all_ = candidates(view.model, extra)
    joints = sorted({c.joint for c in all_})
    groups_, statistics, gains, nulls = [], [], [], {}
    for number, joint in enumerate(
        joints
    ):  # a joint at a time: its columns stand in memory together
        if before is not None and joint not in anew:
            own = [k for k, g in enumerate(before.groups) if g.candidate.joint == joint]
            groups_ += [before.groups[k] for k in own]
            statistics, gains = [*statistics, before.statistics[own]], [*gains, before.gains[own]]
            nulls[joint] = before.null[joint]
        else:
            found = groups(view, [c for c in all_ if c.joint == joint])
            groups_ += found
            statistics, gains = (
                [*statistics, null.statistics(found)],
                [*gains, np.array([gain(g).sum() for g in found])],
            )
            nulls[joint] = null.maxima(
                found, np.random.default_rng(0)
            )  # the same signs for all: draws of one residual
        tell((number + 1) / len(joints))
    return Asked(groups_, np.concatenate(statistics), np.concatenate(gains), nulls)
