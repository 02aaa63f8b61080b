"""A stop that a joint meets at one end of its motion: a law of no catalogue's, as a stop is no part of a
joint, which is asked of the joint where much of what is left lies there.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from .candidates import own_effects
from .effect import Effect
from .effect_parameters import Linear, called
from .formula import Formula
from .model import Model
from .specs import Experiment

END = 0.1  # of the rows, at one end of a joint's motion
_HALF, _FEWEST = 0.5, 200  # of the squares that they hold; rows
_MORE = 1.5  # times as many rows where angles are alike: more of them are no end
LAWS = {"upper_stop": "k*max(q - q0, 0)", "lower_stop": "k*min(q - q0, 0)"}


class Stop(Formula):
    """Something soft that a joint meets at one end of its motion, and presses on with a torque in proportion to how far it goes on."""

    looks_like = "torque at one end of the motion alone, the greater the farther the joint goes"
    separate_by = "a motion that keeps clear of that end, and one that goes there slowly"
    source = "Hooke's law, one-sided"

    def __init__(self, name: str, joints: Collection[int] = ()):
        """joints: the numbers of those of which it is asked."""
        super().__init__(LAWS[name], name)
        self.at = tuple(joints)
        self.spelled = "formula", {"formula": LAWS[name], "name": name}

    def coefficients(self):
        return (called(Linear("SI", lower=0.0, says="stiffness"), "k"),)

    def variants(self, robot, joint):
        return [{}] if joint in self.at else []

    def sized(self, motion, rows, joint):
        """Where it may be met: from the middle of the motion to its end."""
        q = motion.q[:, joint]
        ends = (np.median(q), q.max()) if self.name == "upper_stop" else (q.min(), np.median(q))
        low, high = map(float, ends)
        return tuple(
            called(replace(shape, low=low, high=max(high, low + 1e-9)), "q0")
            for shape in super().sized(motion, rows, joint)
        )


def asked_too(experiment: Experiment, view) -> list[Effect]:
    """The effects that are asked beside the catalogue's: the user's own, and a stop of each joint half
    of whose squares lies in the tenth of its rows that is nearest to one end of its motion.

    Args:
        view: of the model, a `view.View`.
    """
    q, left = view.rows.of(view.motion, "q"), view.rows.residual(view.settled.x)
    ends = {j: _ends(q, left, view.rows.use, j) for j in range(q.shape[1])}
    at = {name: [j for j, own in ends.items() if name in own] for name in LAWS}
    return with_stops(own_effects(experiment), view.model, at)


def with_stops(own: Sequence[Effect], model: Model, at: dict[str, Collection[int]]) -> list[Effect]:
    """The user's own effects and the stops that may be asked of joints, {name: their numbers}: not
    one of whose name there is an own law."""
    taken = {effect.name for effect in [*own, *(effect for effect, _ in model.terms)]}
    asked = {name: joints for name, joints in at.items() if joints and name not in taken}
    return [*own, *(Stop(name, joints) for name, joints in asked.items())]


def _ends(q, left, use, j: int) -> list[str]:
    """At which ends of a joint's motion half of its squares lies."""
    own = use[:, j]
    if own.sum() < _FEWEST:
        return []
    angle, square = q[own, j], left[own, j] ** 2
    low, high = np.quantile(angle, [END, 1.0 - END])
    parts = {"upper_stop": angle >= high, "lower_stop": angle <= low}
    return [
        name
        for name, there in parts.items()
        if there.mean() <= _MORE * END and square[there].sum() > _HALF * square.sum() > 0.0
    ]
