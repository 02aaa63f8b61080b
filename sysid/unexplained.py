"""Why error that stands above a noise floor is left without a name, and a name without a size, in
words."""

from __future__ import annotations

import numpy as np

_CLEAR = 2.0  # standard deviations


def unexplained(error: float, floor, looks: str, weighed: float | None, carries: bool) -> str:
    """Why a joint is unresolved.

    Args:
        error: on the test logs. floor: its NoiseFloor. looks: the effect that may be what is left.
            weighed: the error where each joint counts by its noise, where that makes most of the
            difference. carries: whether the error of the training logs stands above the floor too.
    """
    if not error > 0.0:
        return "none of its rows on the test logs counts: unused, at a standstill, or disturbed"
    if looks:
        return (
            f"what is left may be {looks} or a law that the catalogue does not have: these logs do "
            "not tell"
        )
    if floor.rms is None:
        return (
            f"its noise floor is not known ({floor.detail}), so nobody can say what error is left "
            "above it"
        )
    times = error / max(floor.rms, 1e-300)
    if weighed is not None:
        return (
            f"its error is {times:.2g} times the noise floor because joints with more noise count "
            "as much as quiet ones in this fit; with solver.weighting: noise it would be "
            f"{weighed / floor.rms:.2g} times"
        )
    if not carries:
        return (
            "the training logs are explained and the test logs are not: the model does not carry "
            "over to them"
        )
    return (
        f"its error is {times:.2g} times the noise floor, and nothing in the motion of these logs "
        "predicts the rest"
    )


def nought(numbers: dict[str, tuple[float, float, str]]) -> bool:
    """Whether all of an effect's parameters {name: (value, std, unit)} that are determined are
    nothing beside their standard deviations, or none is determined."""
    return all(abs(at) <= _CLEAR * std for at, std, _ in numbers.values() if np.isfinite(std))


def hidden_by_weights(effect: str, joint: str, numbers, weights) -> str | None:
    """What to know where a fit in which all joints count alike (`weights` None) does not tell the
    size of an effect that is there.

    Args:
        numbers: its parameters, as of `nought`.
    """
    if weights is not None or not nought(numbers):
        return None
    return (
        f"{effect} on {joint} is there, but this fit tells its size badly: joints with more noise "
        "count as much as quiet ones; solver.weighting: noise tells it better"
    )
