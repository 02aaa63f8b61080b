"""A fleet as a JSON document."""

from __future__ import annotations

import numpy as np

from ..fit_document import number, versions
from .analysis import Fleet
from .drift import YEAR
from .oddity import weights_of
from .spread import spread


def document(found: Fleet, run="") -> dict:
    """The document of `sysid fleet`. NaN is None."""
    coordinates, spread_ = found.coordinates, found.spread
    level = found.rate / found.questions / coordinates.size
    names = [m.name for m in found.members]
    by_cause: dict[str, list[str]] = {}
    for i, causes in found.odd.items():
        for cause in causes:
            by_cause.setdefault(cause.name, []).append(names[i])
    shared, differs = [], []
    for k, (name, unit) in enumerate(zip(coordinates.names, coordinates.units)):
        if not np.isfinite(spread_.mean[k]):
            continue
        own = {
            "parameter": name, "value": float(spread_.mean[k]), "unit": unit,
            "std": number(np.sqrt(spread_.variance[k])),
        }  # fmt: skip
        own |= {"between": number(spread_.between[k]), "within": _within(found.variances[:, k])}
        own |= {"p_value": number(found.differs[k]), "odd": by_cause.pop(name, [])}
        differs.append(own) if own["odd"] or found.differs[k] < level else shared.append(own)
    differs += [_of_body(found, name, odd) for name, odd in by_cause.items()]
    return {
        "robots": {m.name: _robot(found, i) for i, m in enumerate(found.members)},
        "shared": [{k: v for k, v in own.items() if k != "odd"} for own in shared],
        "differs": differs,
        "odd": [_odd(found, i, cause) for i, causes in found.odd.items() for cause in causes],
        "drift": _drift(found, level),
        "false_alarm_rate": found.rate,
        "threshold": found.threshold,
        "stated_deviations_times": {
            name: float(np.sqrt(factor)) for name, factor in zip(coordinates.names, found.inflation)
        },
        "filter": found.kind.filters,
        "failed": [{"experiment": path, "says": why} for path, why in found.failed],
        "notices": _notices(found),
        "versions": versions(),
        "run": str(run),
    }  # fmt: skip


def _within(variances) -> float | None:
    known = variances[np.isfinite(variances)]
    return float(np.sqrt(np.median(known))) if len(known) else None


def _robot(found: Fleet, i: int) -> dict:
    m, p = found.members[i], found.judged.p[i]
    told = np.isfinite(p).any()
    return {
        "experiment": m.path,
        "rms_test": m.rms,
        "rms_test_of_mean": {j: float(v) for j, v in zip(found.kind.joints, found.mean_rms[i])},
        "converged": m.converged,
        "date": None if m.date is None else m.date.text,
        "date_from": None if m.date is None else m.date.field,
        "odd": i in found.odd,
        "least_p_value": float(np.nanmin(p)) if told else None,
        "parameters": {
            name: {
                "value": float(found.values[i, k]), "std": float(np.sqrt(found.variances[i, k])),
                "z_score": number(found.judged.z[i, k]),
                "odd": bool(i in found.odd and p[k] < found.threshold),
            }
            for k, name in enumerate(found.coordinates.names)
            if np.isfinite(found.values[i, k])
        },
    }  # fmt: skip


def _odd(found: Fleet, i: int, cause) -> dict:
    place = {name: k for k, name in enumerate(found.coordinates.names)}
    mean = found.spread.mean[place[cause.name]] if not cause.body else np.nan
    return {
        "robot": found.members[i].name,
        "parameter": cause.name,
        "body": cause.body or None,
        "size": cause.size,
        "std": number(cause.std),
        "unit": cause.unit,
        "relative": number(cause.size / mean) if mean else None,
        "p_value": cause.p,
        "parameters": {
            name: {"size": v, "std": number(s), "unit": unit}
            for name, (v, s, unit) in cause.values.items()
        },
        "tied_with": list(cause.tied),
    }


def _of_body(found: Fleet, name: str, odd: list[str]) -> dict:
    """How a body's parameter that is no base parameter spreads, were that body alone to differ."""
    body, _, word = name.rpartition(".")
    unit = next(c.unit for causes in found.odd.values() for c in causes if c.name == name)
    weights = weights_of(found.coordinates, body, word, found.spread.between, found.variances)
    deviation = np.nan_to_num(found.judged.deviation)
    values = (deviation @ weights)[:, None]
    variances = (np.nan_to_num(found.variances) @ weights**2)[:, None]
    own = spread(values, variances)
    return {
        "parameter": name, "value": None, "unit": unit, "std": None,
        "between": number(own.between[0]), "within": _within(variances[:, 0]), "p_value": None,
        "odd": odd,
    }  # fmt: skip


def _drift(found: Fleet, level: float) -> list[dict]:
    if found.drift is None:
        return []
    d, names, units = found.drift, found.coordinates.names, found.coordinates.units
    listed = [
        {
            "parameter": names[k], "per_year": float(d.slope[k]), "std": float(d.std[k]),
            "per_day": float(d.slope[k] / YEAR), "unit": units[k], "p_value": float(d.p[k]),
        }
        for k in np.flatnonzero(np.nan_to_num(d.p, nan=1.0) < level)
    ]  # fmt: skip
    return sorted(listed, key=lambda entry: entry["p_value"])


def _notices(found: Fleet) -> list[str]:
    out = []
    dates = sum(m.date is not None for m in found.members)
    if found.drift is None:
        said = "four or more different days are needed to tell a drift"
        out.append(f"{dates} of {len(found.members)} experiments have a date; {said}")
    worst = float(np.sqrt(found.inflation.max()))
    if worst > 1.5:
        name = found.coordinates.names[int(np.argmax(found.inflation))]
        out.append(
            f"training and test logs of one robot lie up to {worst:.2g} times as far apart as "
            f"their deviations say ({name}): all deviations here are widened by what each needs"
        )
    slow = [m.name for m in found.members if not m.converged]
    if slow:
        out.append(f"the fit of {', '.join(slow)} did not converge; its own RMS is not the least")
    return out
