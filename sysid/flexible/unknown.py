"""The unknown: how much of a residual functions of the motion predict, or a steady tone holds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .. import blocks
from .functions import DIRECTION, groups
from .ridge import predicted, stretches
from .tone import TONE, steady

HUM = "a steady tone"
TOLD = 0.02  # of a squared residual: less is not told of one variable
_ALONE = 0.5  # of what functions of a variable and of the direction predict: else both are told
# Of a squared residual: two that differ by less correlate by 0.99; and by how much their difference
# may follow what was predicted, so that its share changes by a hundredth
_SAME, _FOLLOWS = 0.02, 0.005
LEVEL = 0.01  # family-wise and nominal, as of effects: a law is said to be missing, and none is


@dataclass(frozen=True)
class Law:
    """The function of the motion, alone, that stands out most of a residual: `chance` of one that
    stands out as much, were nothing there; the `variables` that it is of; `share`: what it takes of
    the squared residual of blocks that it was not fitted on."""

    chance: float
    variables: str
    share: float

    @property
    def inertial(self) -> bool:
        """Whether it is of an acceleration: what inertia makes of the angles' noise, and what a
        filter leaves of an acceleration that changes quickly, go with it."""
        return "qdd_" in self.variables

    def predicts(self, joints: int, worth: float) -> bool:
        """Whether it predicts a part worth having, as one of two questions asked of each of
        `joints`."""
        return self.chance < 0.5 * LEVEL / joints and self.share > worth


@dataclass(frozen=True)
class Unknown:
    """What a flexible function takes of a joint: gain (folds,) of the weighted squared residual;
    told (n,) the torque that it predicts of folds that it was not fitted on, weighted; shares
    {variable: share of the squared residual that functions of it alone, and of the direction of
    motion, predict}; residual (n,): what was asked; chance: the probability of predictions as good
    as these, were nothing there; tone: the share of a steady tone, zero where there is none;
    single: the share that one function alone predicts, where these were asked one by one; hertz: of
    the tone."""

    gain: np.ndarray
    told: np.ndarray
    shares: dict[str, float]
    residual: np.ndarray
    chance: float = 1.0
    tone: float = 0.0
    single: float = 0.0
    hertz: float = 0.0

    @property
    def total(self) -> float:
        """The squared residual."""
        return max(float(np.sum(self.residual**2)), 1e-300)

    def of(self, residual) -> Unknown | None:
        """The same of another residual (n,) that is this one, in other units; None of any other."""
        if len(residual) != len(self.residual):
            return None
        unit = float(residual @ self.residual) / self.total
        own, whole = unit * self.residual, float(np.sum(residual**2))
        change = residual - own
        if change @ change > _SAME * whole or abs(change @ self.told * unit) > _FOLLOWS * whole:
            return None
        return replace(self, gain=self.gain * unit**2, told=unit * self.told, residual=own)

    @property
    def predicted(self) -> float:
        """Of the squared residual, what functions of the motion predict."""
        return max(float(self.gain.sum() / self.total), self.single)

    @property
    def share(self) -> float:
        """Of the squared residual: what functions of the motion predict, or a tone holds, whichever
        is more."""
        return max(self.predicted, self.tone)

    @property
    def drifts(self) -> bool:
        """Whether most of what is predicted goes with time alone, and next to nothing with anything
        else: noise as slow as that is a drift, which blocks of time cannot tell from a law."""
        time = self.shares.get("time", 0.0)
        other = max((own for name, own in self.shares.items() if name != "time"), default=0.0)
        return self.tone < TOLD and time > _ALONE * self.predicted > 0.0 and other < _ALONE * time

    def predictable(self, joints: int, worth: float) -> bool:
        """Whether functions of the motion predict a part worth having, or a tone holds it. Two
        questions may be asked of each of `joints`, those above their floors: each has half of the
        level."""
        functions = self.chance < 0.5 * LEVEL / joints and self.predicted > worth
        return bool(functions or self.tone > worth)

    def with_law(self, found: Law, joints: int, worth: float) -> Unknown:
        """This and the function that stands out most, where it predicts a part worth having; the
        chance is the smaller one of the two."""
        if not found.predicts(joints, worth):
            return self
        share = min(found.share, 1.0)
        shares = self.shares | {found.variables: max(share, self.shares.get(found.variables, 0.0))}
        return replace(self, chance=min(self.chance, found.chance), shares=shares, single=share)


def unknown(
    known: dict[str, np.ndarray],
    joint: str,
    residual,
    use,
    fold,
    piece,
    step: float,
    rng: np.random.Generator,
    noise=0.0,
) -> Unknown:
    """What a flexible function of the motion takes of a joint's residual, over folds that it was
    not fitted on.

    Args:
        known: {q_joint, qd_joint, qdd_joint, load_joint of every joint, time: (n,)}. residual:
            (n,), zero where `use` (n,) is not set.
        fold: (n,) number of each row's fold. piece: (n,) of its piece, ascending.
        noise: (n,) what the noise of the angles, drawn once more, adds to the residual.
    """
    spans = stretches(fold, known["time"], piece)
    told_by = groups(known, joint, piece, step, rng)
    tried = {name: predicted(values, residual, use, spans) for name, values in told_by.items()}
    best = max(tried, key=lambda name: tried[name][1].sum())
    told, gain = tried[best]
    memory = blocks.memory((residual - told)[:, None], use[:, None], piece, step)
    number = blocks.numbered(known["time"], piece, memory=memory)
    # as many questions as groups of functions
    chance = min(
        1.0,
        len(tried)
        * min(blocks.slope_chance(one, residual, number, mutual=True) for one, _ in tried.values()),
    )
    total = max(float(np.sum(residual**2)), 1e-300)
    shares = {name: float(one[1].sum() / total) for name, one in tried.items() if name != "*"}
    for name in [n for n, own in shares.items() if own > TOLD and n != f"qd_{joint}"]:
        alone = told_by[name][:, : told_by[name].shape[1] // 2]  # the rest is times the direction
        if predicted(alone, residual, use, spans)[1].sum() < _ALONE * shares[name] * total:
            shares[f"{name} and {DIRECTION}"] = shares.pop(name)
    share, by_chance, hertz = steady(residual, noise, step)
    if by_chance >= TONE:
        return Unknown(gain, told, shares, residual, chance)
    shares[HUM] = share
    return Unknown(gain, told, shares, residual, chance, tone=share, hertz=hertz)
