"""The JSON document of a fit, and the program that made it."""

import hashlib
import math
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from . import base_parameters, prior_weight
from .differences import per_group
from .estimate import Fit
from .filters import settled, torque_band
from .given_shapes import at_edge
from .model import Model

_PACKAGES = ("sysid", "pin", "numpy", "scipy", "yourdfpy", "lxml", "polars")


_SOURCES = Path(__file__).resolve().parent


def document(fit: Fit, run: str | Path = "") -> dict:
    """The JSON document of a fit, as the contract has it and more. NaN is None."""
    errors = {part: prediction.errors() for part, prediction in fit.predictions.items()}
    # a joint whose torque never changes has no relative error and no R2
    by_joint = lambda part, key: {j: number(v) for j, v in zip(fit.joints, errors[part][key].tolist())}  # noqa: E731
    names, coefficients = fit.model.names, fit.model.coefficients
    certificate = fit.certificate
    held = np.append(np.zeros(10 * fit.model.bodies, dtype=bool), fit.held)
    parameters = [
        {"name": name, "value": value, "unit": unit, "std": number(std), "from_data": share, **({"held": True} if fixed else {})}
        for name, value, unit, std, share, fixed in zip(
            names, fit.x.tolist(), fit.model.units, fit.uncertainty.std.tolist(), fit.uncertainty.from_data.tolist(), held
        )
    ]
    parameters += [
        {"name": value.name, "value": at, "unit": value.unit, "std": number(std), "from_data": float(math.isfinite(std)), **({"held": True} if value.held else {})}
        for value, at, std in zip(fit.model.shape_values, fit.model.shapes, fit.shape_std.tolist())
    ]
    own_groups = {"groups": groups} if (groups := per_group(fit)) else {}
    return {
        "rms": {part: dict(zip(fit.joints, fit.predictions[part].told())) for part in errors},
        "band": torque_band(settled(fit.experiment.preprocess, fit.filters)),
        "relative_error": {part: {**by_joint(part, "relative_error"), "*": number(errors[part]["total"][1])} for part in errors},
        "r2": {part: by_joint(part, "r2") for part in errors},
        "objective": fit.objective,
        "iterations": fit.solution.iterations,
        "newton_iterations": fit.solution.newton_iterations,
        "converged": fit.solution.converged,
        "physically_consistent": fit.physically_consistent,
        "certificate": {
            "globally_optimal": certificate.globally_optimal, "stationarity": number(certificate.stationarity),
            "gap": number(certificate.gap), "at_zero": {coefficients[k].name: slope for k, slope in certificate.at_zero.items()},
            "given": _given(fit),
        },
        "samples": fit.samples,
        "left_out": fit.left_out,
        "parameters": parameters,
        **own_groups,
        # sums of parameters that the logs tell where they cannot tell each
        "base_parameters": [
            {"name": one.words, "value": one.value, "std": number(one.std), "unit": one.unit, "terms": dict(one.terms)} for one in base_parameters.combinations(fit)
        ],
        # what the effects that look at the load took for the bodies; the last step towards `parameters` is not taken again
        "load_bodies": _by_body(fit.model),
        "drives": [{"joint": d.joint, "name": d.name, "value": d.value, "std": number(d.std), "unit": d.unit} for d in fit.drives],
        "rollout": fit.rollout,
        "weights": None if fit.weights is None else dict(zip(fit.joints, fit.weights.tolist())),
        "filter": fit.filters,
        "prior": prior_weight.document(fit.strength),
        "implausible_masses": fit.masses or None,
        "robot": {"joints": list(fit.joints), "locked": fit.model.robot.locked},
        "notices": list(fit.notices),
        "logs": list(fit.logs),
        "events": list(fit.events),
        "versions": versions(),
        "seeds": {},  # nothing in a fit is random
        "seconds": fit.seconds,
        "run": str(run),
    }  # fmt: skip


def _by_body(model: Model) -> dict[str, list[float]] | None:
    if model.reference is None:
        return None
    return {body.name: pi.tolist() for body, pi in zip(model.robot.bodies, model.reference)}


def _given(fit: Fit) -> list[dict]:
    """The shape values at which a certificate proves the rest, with what was done about each."""
    done = {one.name: one for one in fit.searched}
    return [
        {
            "name": value.name, "range": [value.low, value.high], "held": value.held, "at_edge": at_edge(value, at),
            "starts": done[value.name].starts if value.name in done else 0, "profile": done[value.name].profile if value.name in done else 0,
            "lower_on_profile": value.name in done and done[value.name].lower,
        }
        for value, at in zip(fit.model.shape_values, fit.model.shapes)
    ]  # fmt: skip


def number(value: float) -> float | None:
    """A number as JSON can hold it: None for NaN and infinity."""
    return float(value) if math.isfinite(value) else None


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that the numbers depend on."""
    found = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


@cache
def program() -> str:
    """SHA-256 of this package's own modules: a version number stays while a program is changed."""
    state = hashlib.sha256()
    for path in sorted(_SOURCES.rglob("*.py")):
        state.update(path.relative_to(_SOURCES).as_posix().encode() + path.read_bytes())
    return state.hexdigest()
