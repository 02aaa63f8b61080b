"""Filters that are too narrow: for how noisy angles are, as one that smooths more leaves clearly less, or for so few samples."""

from __future__ import annotations

from collections.abc import Callable

from .blocks import within_one_error
from .errors import ConfigError
from .smoother import Smoother
from .specs import PreprocessSpec

# Of a joint's error: in the rest a noise floor may be in doubt (noise.DOUBT); and of the other joints, half of that
_LESS, _ALSO = 0.9, 0.95


def wider(tried: list[dict], key: str, value: float) -> dict:
    """Of a filter that was given, the neighbour that smooths more, where it leaves less by more than one standard error, and of some
    joint by a tenth, in which a noise floor may be in doubt: angles are noisy for what was given. {} where it does not."""
    least = min(tried, key=lambda entry: entry["relative_error"], default={})
    given = next((entry for entry in tried if entry[key] == value), least)
    smooths = given is not least and (least[key] > value) == (key == "window")
    if not smooths or len(given["folds"]) != len(least["folds"]) or within_one_error([least["folds"], given["folds"]], 0)[1]:
        return {}
    less = {joint: [rms, least["rms"][joint]] for joint, rms in given["rms"].items() if least["rms"][joint] < _ALSO * rms}
    return {"key": key, "given": value, "value": least[key], "rms": less} if any(wide < _LESS * rms for rms, wide in less.values()) else {}


def by_noise(tried: list[dict], key: str, value: float, again: Callable[[float], dict | None]) -> dict:
    """The same, where the wider one leaves less because it smooths more, and not by the rows that it leaves out, in which the model errs.

    Args:
        again: what the given one leaves, fitted to the rows of another alone.
    """
    found = wider(tried, key, value)
    alike = again(found["value"]) if found else None
    return wider([alike, *(entry for entry in tried if entry[key] == found["value"])], key, value) if alike else found


def said(wider: dict) -> str:
    """What a wider one leaves, in words."""
    joint, (rms, less) = min(wider["rms"].items(), key=lambda one: one[1][1] / one[1][0])
    unit = "s" if wider["key"] == "window" else "Hz"
    return (
        f"angles are noisy for {wider['given']:g} {unit}: with {wider['value']:g} {unit} {len(wider['rms'])} of the joints have less error on stretches "
        f"of the training logs that were held apart ({joint}: {less:.4g} instead of {rms:.4g})"
    )


def noise_as_law(chosen: dict) -> dict[str, str]:
    """{joint: why} of joints of which what a motion predicts may be noise of the angles, for which a filter that was given is too narrow."""
    wider = chosen.get("too_narrow") or {"rms": {}}
    return {
        joint: f"angles are noisy for a {wider['key']} of {wider['given']:g}, and with {wider['value']:g} its error on stretches held apart falls from "
        f"{rms:.4g} to {less:.4g}: noise that inertia makes torque of bends the bodies, and what the motion predicts may be that; write "
        f"`{wider['key']}: auto` under `preprocess:` in the experiment file, and fit again"
        for joint, (rms, less) in wider["rms"].items()
    }


def impossible(spec: PreprocessSpec, step: float) -> str:
    """Why a filter cannot be of samples so many seconds apart; empty where it can."""
    try:
        Smoother(spec, step)
    except ConfigError as error:
        return str(error).partition(";")[0]
    return ""
