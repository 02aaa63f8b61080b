"""What differs from level to level of a group of logs, and by how much more than it is uncertain.

All levels stand in one fit, so that the difference of two has the deviation that their covariance
gives: what the shared bodies leave open is left open at both, and is none of the difference's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .errors import SysidError


@dataclass(frozen=True)
class Parameter:
    """A parameter that is per group. values, std: (levels,), NaN where the logs do not tell it;
    covariance: (levels, levels)."""

    name: str
    group: str
    unit: str
    levels: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray

    @property
    def std(self) -> np.ndarray:
        """(levels,) standard deviations."""
        return np.sqrt(np.clip(np.diagonal(self.covariance), 0.0, None))

    def difference(self, a: int, b: int) -> tuple[float, float]:
        """Value at level b less that at level a, and its standard deviation."""
        spread = self.covariance[a, a] + self.covariance[b, b] - 2.0 * self.covariance[a, b]
        return float(self.values[b] - self.values[a]), math.sqrt(max(spread, 0.0))

    @property
    def within(self) -> float:
        """Typical standard deviation of one level's value: root mean square over the levels."""
        told = self.std[np.isfinite(self.std)]
        return float(np.sqrt(np.mean(told**2))) if len(told) else math.nan

    @property
    def between(self) -> float:
        """Standard deviation of the levels themselves: what their values spread by beyond what
        their covariance explains; NaN of fewer than two.

        The spread's expectation is that of the levels and of the covariance about its own mean
        (method of moments). Source: DerSimonian & Laird 1986.
        """
        told = np.flatnonzero(np.isfinite(self.std))
        if len(told) < 2:
            return math.nan
        cov, n = self.covariance[np.ix_(told, told)], len(told)
        explained = (np.trace(cov) - cov.sum() / n) / (n - 1)
        return math.sqrt(max(float(np.var(self.values[told], ddof=1)) - explained, 0.0))


def parameters_per_group(fit) -> list[Parameter]:
    """Every parameter of a `Fit` that is per group, in the model's order; coefficients, then shape
    values."""
    model, first = fit.model, 10 * fit.model.bodies
    places: dict[tuple[str, str], list[tuple[str, str, float, int, bool]]] = {}
    entries = [(c.term, c.name, c.unit, first + k, False) for k, c in enumerate(model.coefficients)]
    entries += [(v.term, v.name, v.unit, k, True) for k, v in enumerate(model.shape_values)]
    for term, name, unit, at, shape in entries:
        effect = model.terms[term][0]
        if effect.group is not None:
            whole = name.removesuffix(f"[{effect.level}]")
            places.setdefault((effect.group, whole), []).append((effect.level, unit, at, shape))
    out = []
    for (group, name), own in places.items():
        at, shape = [place for _, _, place, _ in own], own[0][3]
        values = np.asarray(model.shapes if shape else fit.x)[at]
        known = fit.shape_covariance if shape else fit.uncertainty.covariance
        std = (fit.shape_std if shape else fit.uncertainty.std)[at]
        covariance = np.array(known[np.ix_(at, at)])
        untold = ~np.isfinite(std)
        covariance[untold] = covariance[:, untold] = np.nan
        levels = tuple(level for level, *_ in own)
        out.append(Parameter(name, group, own[0][1], levels, values, covariance))
    return out


def per_group(fit) -> dict:
    """{group: its levels' logs, and each of its parameters at each level, with the differences from
    the first level}, as fit.json has it."""
    number = lambda value: float(value) if math.isfinite(value) else None  # noqa: E731
    found = parameters_per_group(fit)
    return {
        group: {
            "levels": {level: [log.name for log in logs] for level, logs in levels.items()},
            "parameters": [
                {
                    "parameter": p.name, "unit": p.unit,
                    "levels": {
                        level: {"value": float(value), "std": number(std)}
                        for level, value, std in zip(p.levels, p.values, p.std)
                    },
                    "differences": [
                        {"from": p.levels[0], "to": p.levels[k], "value": value, "std": number(std)}
                        for k in range(1, len(p.levels))
                        for value, std in [p.difference(0, k)]
                    ],
                    "between": number(p.between), "within": number(p.within),
                }
                for p in found if p.group == group
            ],
        }
        for group, levels in fit.experiment.data.groups.items()
        if group in fit.model.groups
    }  # fmt: skip


def difference(fit, parameter: str, a: str, b: str) -> tuple[float, float]:
    """Value of a parameter at level b less that at level a, and its standard deviation.

    Args:
        parameter: its name without a level, `viscous.hip.Fv`.

    Raises:
        SysidError: there is no such parameter per group, or no such level of it.
    """
    there = {p.name: p for p in parameters_per_group(fit)}
    if parameter not in there:
        allowed = ", ".join(there) or "none: no effect is per a group"
        raise SysidError(f"there is no parameter {parameter!r} per group", allowed=allowed)
    own = there[parameter]
    for level in (a, b):
        if level not in own.levels:
            allowed = ", ".join(own.levels)
            raise SysidError(f"{parameter} has no level {level!r}", allowed=allowed)
    return own.difference(own.levels.index(a), own.levels.index(b))


def told(groups: dict) -> list[str]:
    """What `per_group` says, a line for each parameter."""
    out = []
    for group, found in groups.items():
        for p in found["parameters"]:
            apart = {d["to"]: d for d in p["differences"]}
            own = "; ".join(
                f"{level} {give_or_take(at)}"
                + (f" ({give_or_take(apart[level], '+')})" if level in apart else "")
                for level, at in p["levels"].items()
            )
            first, *others = p["levels"]
            beside = f", in brackets the difference from {first}" if others else ""
            out.append(f"{p['parameter']} [{p['unit']}] per {group}{beside}: {own}")
    return out


def give_or_take(entry: dict, sign: str = "") -> str:
    """A value with its standard deviation, where the logs tell one."""
    std = "" if entry["std"] is None else f" +- {entry['std']:.2g}"
    return f"{entry['value']:{sign}.4g}{std}"
