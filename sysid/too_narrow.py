"""Filters that are too narrow: for how noisy angles are, as one that smooths more leaves clearly less, or for so few samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from .blocks import within_one_error
from .errors import ConfigError, SysidError
from .filter_errors import made_by_noise
from .log import Log
from .lowpass import angle_noise, band, hardly_moving, noisier, widest
from .model import Model
from .smoother import Smoother
from .specs import Experiment, PreprocessSpec
from .warned import noticed

# Of a joint's error: in the rest a noise floor may be in doubt (noise.DOUBT); and of the other joints, half of that
_LESS, _ALSO = 0.9, 0.95
_MAKES = 2.0  # times the square that noise makes: one draw of few rows tells it to less than that


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


def by_noise(tried: list[dict], key: str, value: float, made: Callable[[float], dict | None]) -> dict:
    """As `wider`, where what the wider one leaves less is no more than the noise of the angles makes: it smooths a gear's blows as well, and
    leaves out more of the rows about a reversal, a stop, a jump, in which a model may err.

    Args:
        made: {joint: mean square} that the noise of the angles makes of the given one's error, by the parameters that another tells.

    Source: Cook & Stefanski 1994 (simulation extrapolation).
    """
    found = wider(tried, key, value)
    squares = made(found["value"]) if found else None
    if squares is None:
        return found
    less = explained(found["rms"], squares)
    return found | {"rms": less} if less else {}


def explained(rms: dict[str, list[float]], squares: dict[str, float]) -> dict[str, list[float]]:
    """Of {joint: [RMS, less with another filter]} those that lose no more than the noise of the angles makes; none where it is little of
    all of them.

    Args:
        squares: {joint: mean square} that this noise makes.
    """
    less = {joint: both for joint, both in rms.items() if both[0] ** 2 - both[1] ** 2 <= _MAKES * squares[joint]}
    return less if any(wide < _LESS * own for own, wide in less.values()) else {}


def as_far(chosen: dict, wider: dict, made: Callable[[float], dict | None]) -> dict:
    """A choice among all filters, or the one that is known to leave less by the noise of the angles where this one leaves less by more."""
    key, left = wider["key"], {entry[wider["key"]]: entry["rms"] for entry in chosen["held_out"]}
    given, best = left.get(wider["given"]), left.get(chosen[key])
    squares = made(chosen[key]) if given and best and chosen[key] != wider["given"] else None
    if squares is None or explained({joint: [rms, best[joint]] for joint, rms in given.items()}, squares):
        return chosen
    return chosen | {key: wider["value"]}


def noise_makes(
    experiment: Experiment, narrow: PreprocessSpec, wide: PreprocessSpec, model: Model, logs: Sequence[Log], prior, edge: float
) -> dict | None:  # fmt: skip
    """As of `made_by_noise`; None where logs are too short for it."""
    try:
        with noticed():
            return made_by_noise(experiment, narrow, wide, model, logs, _noisier(logs), prior, edge)
    except SysidError:
        return None


def _noisier(logs: Sequence[Log]) -> list[Log]:
    """Logs with the noise of their angles once more."""
    rng, own = np.random.default_rng(0), band(logs)
    cutoff = widest(logs, known=own)
    return noisier(logs, lambda segment: angle_noise(segment, cutoff), hardly_moving(cutoff, own), rng)


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
