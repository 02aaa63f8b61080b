"""Why error that stands above a noise floor is left without a name, in words."""

from __future__ import annotations


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
