"""What was identified, and from what: each parameter with its uncertainty and its prior."""

from __future__ import annotations

from .. import fit_document
from ..estimate import Fit
from ..inertia import PARAMETERS, UNITS
from ..model_parameters import ROBOT
from . import charts
from .section import Section
from .whiskers import whiskers
from .words import number, plus_minus, unit_of

_SPANS = (("mass", 0, 1), ("first moment", 1, 4), ("second moment", 4, 10))


def parameters(fit: Fit) -> Section:
    """Parameters with uncertainty, the prior, and how much the data say."""
    document = fit_document.document(fit)
    known = document["parameters"]
    bodies = fit.model.robot.bodies
    others = known[10 * fit.model.bodies :]
    groups = [_others(fit, others)] if others else []
    for b, (body, prior) in enumerate(zip(bodies, fit.prior.tolist())):
        groups.append(_body(b, body, known[10 * b : 10 * b + 10], prior))
    says = fit.strength.says
    per_group = [_per_group(*found) for found in document.get("groups", {}).items()]
    values = {"groups": groups, "per_group": per_group, "strength": says[0].upper() + says[1:]}
    return Section("Parameters", "parameters", values, [group["chart"] for group in groups])


def _body(b: int, body, own: list[dict], prior: list[float]) -> dict:
    """The ten parameters of a body: heading, rows, chart."""
    panels = [
        {"unit": UNITS[a].replace("^2", "²"), "quantity": what, "names": list(PARAMETERS[a:z])}
        | _columns(own[a:z], prior[a:z])
        for what, a, z in _SPANS
    ]
    label = f"Inertial parameters of {body.name} against the prior"
    mass = plus_minus(own[0]["value"], own[0]["std"])
    seen = sum(p["from_data"] > 0.5 for p in own)
    return {
        "name": body.name,
        "about": f"{body.kind}, mass {mass} kg, {seen} of 10 from the data",
        "label": f"parameters of {body.name}",
        "open": b == 0,
        "rows": [_row(PARAMETERS[k], entry, prior[k]) for k, entry in enumerate(own)],
        "chart": whiskers(f"body{b}", label, panels),
    }


def _others(fit: Fit, others: list[dict]) -> dict:
    """The coefficients and shape values of effects: heading, rows, chart."""
    by_effect: dict[tuple[str, str], list[tuple[str, dict]]] = {}
    own = (*fit.model.coefficients, *fit.model.shape_values)
    for entry, value in zip(others, own):
        level = fit.model.terms[value.term][0].level
        behind = "" if level is None else f"[{level}]"
        word = entry["name"].rpartition(".")[2].removesuffix(behind)
        what = f"{entry['name'].partition('.')[0]}: {word}"
        joint = "whole robot" if value.joint == ROBOT else fit.joints[value.joint]
        place = f"{joint} {behind}".strip()
        by_effect.setdefault((what, entry["unit"]), []).append((place, entry))
    panels = []
    for (what, unit), own in by_effect.items():
        names = [joint for joint, _ in own]
        if len(set(names)) < len(names):
            names = [p["name"] for _, p in own]
        panel = {"unit": unit.replace("^2", "²"), "quantity": charts.plain(what), "names": names}
        panels.append(panel | _columns([p for _, p in own], [None] * len(own)))
    zero = {fit.model.coefficients[k].name for k in fit.certificate.at_zero}
    return {
        "name": "friction and other effects",
        "about": f"{len(others)} coefficients",
        "label": "friction and other effects",
        "open": True,
        "rows": [_row(entry["name"], entry, None, entry["name"] in zero) for entry in others],
        "chart": whiskers("effects", "Coefficients of friction and other effects", panels),
    }


def _per_group(group: str, found: dict) -> dict:
    """What differs from level to level of a group of logs."""
    rows = []
    for p in found["parameters"]:
        apart, first = {d["to"]: d for d in p["differences"]}, next(iter(p["levels"]))
        for level, at in p["levels"].items():
            far, times = "–", "–"
            if other := apart.get(level):
                far = f"{plus_minus(other['value'], other['std'])} from {first}"
                if other["std"]:
                    times = number(abs(other["value"]) / other["std"], 2)
            value = plus_minus(at["value"], at["std"])
            rows.append([p["parameter"], level, value, unit_of(p["unit"]) or "–", far, times])
    return {"group": group, "rows": rows}


def _columns(own: list[dict], priors: list) -> dict:
    """What a panel draws."""
    return {
        "values": [p["value"] for p in own],
        "stds": [p["std"] for p in own],
        "priors": priors,
        "shares": [p["from_data"] for p in own],
    }


def _row(name: str, entry: dict, prior, at_zero: bool = False) -> dict:
    share = float(entry["from_data"] or 0.0)
    return {
        "name": name,
        "value": plus_minus(entry["value"], entry["std"]),
        "at_zero": at_zero,
        "held": bool(entry.get("held")),
        "prior": number(prior),
        "unit": unit_of(entry["unit"]) or "–",
        "percent": f"{100 * share:.0f}",
        "share": f"{share:.2f}",
    }
