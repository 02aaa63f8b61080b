"""A stop that a joint meets at one end of its motion: a law of no catalogue's, as a stop is no part of a
joint, which is asked where much of what is left lies there.
"""

from __future__ import annotations

import numpy as np

from .candidates import own_effects
from .effect import Effect
from .listed_effects import found
from .specs import EffectSpec, Experiment
from .view import View

_END, _HALF = 0.1, 0.5  # of the rows, and of the squares that they hold
_FEWEST = 200  # rows
LAWS = {"upper_stop": "k*max(q - q0, 0)", "lower_stop": "k*min(q - q0, 0)"}


def asked_too(experiment: Experiment, view: View) -> list[Effect]:
    """The effects that are asked beside the catalogue's: the user's own, and a stop where half of a
    joint's squares lies in the tenth of its rows that is nearest to one end of its motion."""
    q, left = view.rows.of(view.motion, "q"), view.rows.residual(view.settled.x)
    there = {name for j in range(q.shape[1]) for name in _ends(q, left, view.rows.use, j)}
    return [*own_effects(experiment), *(_law(name) for name in sorted(there))]


def _law(name: str) -> Effect:
    return found(EffectSpec(name="formula", options={"formula": LAWS[name], "name": name}))


def _ends(q, left, use, j: int) -> list[str]:
    """At which ends of a joint's motion half of its squares lies."""
    own = use[:, j]
    if own.sum() < _FEWEST:
        return []
    angle, square = q[own, j], left[own, j] ** 2
    low, high = np.quantile(angle, [_END, 1.0 - _END])
    parts = {"upper_stop": angle >= high, "lower_stop": angle <= low}
    return [n for n, at in parts.items() if square[at].sum() > _HALF * square.sum() > 0.0]
