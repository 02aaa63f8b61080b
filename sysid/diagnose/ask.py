"""What all candidates answer under one model: statistics, gains, and the null that they share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..blocks import Belief, chance_among
from ..candidates import Candidate, candidates, together
from ..view import View, falls
from . import null
from .evidence import Group
from .projected import groups
from .ties import NEAR

_MAY_BE = 0.05  # family-wise: an effect that may be there, though it is not claimed
HIDES = 0.25  # of a joint's squared residual: without less, statistics grow by less than a seventh
HALF = 0.5  # of what functions of the motion predict: that much may be the effect


@dataclass(frozen=True)
class Asked:
    """The answer of all candidates under one model: {joint: (groups, statistics (groups,),
    gains (groups,), null maxima (draws,))}; how far foreseen spreads are believed; the view."""

    by_joint: dict[int, tuple[list[Group], np.ndarray, np.ndarray, np.ndarray]]
    belief: Belief
    view: View | None = None

    @cached_property
    def groups(self) -> list[Group]:
        """Of all joints."""
        return [group for found, *_ in self.by_joint.values() for group in found]

    @cached_property
    def statistics(self) -> np.ndarray:
        """(groups,)."""
        return np.concatenate([found for _, found, *_ in self.by_joint.values()])

    @cached_property
    def gains(self) -> np.ndarray:
        """(groups,)."""
        return np.concatenate([found for _, _, found, _ in self.by_joint.values()])

    @cached_property
    def falls(self) -> np.ndarray:
        """(groups,) how far everything falls where a candidate comes in and all else settles anew;
        minus infinity but at the values of right sign that take most, and where that is little."""
        best, out = dict[tuple, int](), np.full(len(self.groups), -np.inf)
        for k in sorted(range(len(out)), key=lambda k: (self.groups[k].signed, self.gains[k])):
            best[self.groups[k].candidate.kind] = k
        some = [k for k in best.values() if not self.groups[k].candidate.begins]
        out[some] = falls(self.view, [self.groups[k] for k in some], NEAR * HIDES)
        return out

    @cached_property
    def maxima(self) -> np.ndarray:
        """(draws,) the greatest of all groups."""
        return np.max([found for *_, found in self.by_joint.values()], axis=0)

    def p(self, k: int) -> float:
        """Family-wise p-value of a group."""
        return chance_among(self.statistics[k], self.maxima)

    def threshold(self, level: float) -> float:
        """The statistic beyond chance at a family-wise level; infinity where none is testable."""
        least = self.maxima.min() if len(self.groups) else -np.inf
        return float(np.quantile(self.maxima, 1.0 - level)) if np.isfinite(least) else np.inf

    def told(self, k: int, settled: Group) -> Asked:
        """The answers where the k-th group says what it says about where it has settled; gains are
        what everything `falls` by."""
        out, statistics = replace(self), self.statistics.copy()
        (statistics[k],) = null.statistics([settled], self.belief)
        vars(out).update(statistics=statistics, gains=self.falls)
        return out

    def near(self, joint: int, gain: float, there: bool) -> tuple[Candidate, float] | None:
        """The effect on a joint that may be there and takes half of a gain: the likeliest, else who
        takes most of what no block can test; there: as something surely is, among its own alone."""
        found, statistics, gains, own = self.by_joint.get(joint, ([], [], [], None))
        takes = [k for k, taken in enumerate(gains) if taken > HALF * gain and found[k].signed]
        if not takes:
            return None
        best = max(takes, key=lambda k: np.nan_to_num(statistics[k], nan=-np.inf))
        p, alone = (chance_among(statistics[best], most) for most in (self.maxima, own))
        if (alone if there else p) <= _MAY_BE:
            return found[best].candidate, p
        untold = [k for k in takes if np.isnan(statistics[k])]  # nobody can say that it is not
        return (found[max(untold, key=gains.__getitem__)].candidate, 1.0) if untold else None

    def of(self, candidate: Candidate) -> Group | None:
        """The group of a candidate, of the sign it may have, that takes most; None without one."""
        own = (g for g in self.groups if g.candidate.kind == candidate.kind and g.signed)
        return max(own, key=lambda group: group.taken, default=None)


def ask(view: View, extra=(), tell=lambda share: None, *, before=None, anew=()) -> Asked:
    """Every candidate that a view's model lacks.

    Args:
        tell: is called with the share done. before: answers under the model that this one grew
            from. anew: the joints where it changed something: of all others the answers stand.
    """
    asked = candidates(view.model, extra, sorted({piece.source for piece in view.motion.pieces}))
    joints = sorted({c.joint for c in asked})
    out = {j: before.by_joint[j] for j in joints if before is not None and j not in anew}
    made, new = {j: found for j, (found, *_) in out.items()}, [j for j in joints if j not in out]
    for number, joint in enumerate(new):  # whose columns stand in memory together
        made[joint] = groups(view, [c for c in asked if c.joint == joint], new)
        made[joint] += groups(view, together(made[joint], view.model.robot), new)
        tell((number + 1) / len(new))
    belief = null.believed([group for own in made.values() for group in own])
    for joint, own in ((joint, made[joint]) for joint in new):
        # draws of one residual, the joint's own
        maxima = null.maxima(own, np.random.default_rng(joint + 1), belief)
        out[joint] = own, null.statistics(own, belief), np.array([g.taken for g in own]), maxima
    return Asked(out, belief, view)
