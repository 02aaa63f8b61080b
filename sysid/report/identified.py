"""What was identified, and from what: parameters against the prior, the bodies in space, the provenance."""

from __future__ import annotations

import shlex

import numpy as np

from .. import results
from ..diagnose.diagnosis import Diagnosis
from ..estimate import Fit
from ..inertia import PARAMETERS, UNITS
from ..model import ROBOT
from . import charts, solids
from .words import SPACE, breaking, drawing, empty, number, plus_minus, table, text, unit_of


def parameters(fit: Fit) -> tuple[str, str, list]:
    """Parameters with uncertainty, the prior, and how much the data say."""
    known = results.document(fit)["parameters"]
    count, robot = 10 * fit.model.bodies, fit.model.robot
    drawn, parts = [], []
    spans = (("mass", 0, 1), ("first moment", 1, 4), ("second moment", 4, 10))
    for b, body in enumerate(robot.bodies):
        own, prior = known[10 * b : 10 * b + 10], fit.prior[b].tolist()
        groups = [
            {
                "unit": UNITS[a].replace("^2", "²"), "quantity": what, "names": list(PARAMETERS[a:z]), "values": [p["value"] for p in own[a:z]], "stds": [p["std"] for p in own[a:z]],
                "priors": prior[a:z], "shares": [p["from_data"] for p in own[a:z]],
            }
            for what, a, z in spans
        ]  # fmt: skip
        chart = charts.whiskers(f"body{b}", f"Inertial parameters of {body.name} against the prior", groups)
        drawn.append(chart)
        rows = [_parameter(PARAMETERS[k], entry, prior[k]) for k, entry in enumerate(own)]
        seen = sum(p["from_data"] > 0.5 for p in own)
        parts.append(
            f'<details{" open" if b == 0 else ""}><summary>{text(body.name)} <span class="quiet">{body.kind}, mass {plus_minus(own[0]["value"], own[0]["std"])} kg, {seen} of 10 from the data</span></summary>'
            f'<div class="split">{_parameter_table(rows, f"parameters of {body.name}")}{drawing(chart)}</div></details>'
        )
    others = known[count:]
    if others:
        by_effect: dict[tuple[str, str], list[tuple[str, dict]]] = {}
        places = [c.joint for c in fit.model.coefficients] + [v.joint for v in fit.model.shape_values]
        for entry, place in zip(others, places):
            what = f"{entry['name'].partition('.')[0]}: {entry['name'].rpartition('.')[2]}"
            by_effect.setdefault((what, entry["unit"]), []).append(("whole robot" if place == ROBOT else fit.joints[place], entry))
        groups = []
        for (what, unit), own in by_effect.items():
            names = [joint for joint, _ in own]
            if len(set(names)) < len(names):
                names = [p["name"] for _, p in own]
            groups.append({
                "unit": unit.replace("^2", "²"), "quantity": charts.plain(what), "names": names, "values": [p["value"] for _, p in own], "stds": [p["std"] for _, p in own],
                "priors": [None] * len(own), "shares": [p["from_data"] for _, p in own],
            })  # fmt: skip
        chart = charts.whiskers("effects", "Coefficients of friction and other effects", groups)
        drawn.insert(0, chart)
        zero = {fit.model.coefficients[k].name for k in fit.certificate.at_zero}
        rows = [_parameter(entry["name"], entry, None, at_zero=entry["name"] in zero) for entry in others]
        parts.insert(0, f'<details open><summary>friction and other effects <span class="quiet">{len(others)} coefficients</span></summary><div class="split">{_parameter_table(rows, "friction and other effects")}{drawing(chart)}</div></details>')
    about = (
        '<p class="quiet">± 1 standard deviation in the tables, 2 in the charts. “From data” is 1 where the measurement determines a parameter and 0 where only the prior speaks; '
        "pale dots are values that come from the prior. Most single inertial parameters of a robot cannot be seen in any log, only combinations of them: a low number there is no fault of the log. Moments are about the joint’s frame. "
        f"{text(fit.strength.says[0].upper() + fit.strength.says[1:])}.</p>"
    )
    return "Parameters", about + "".join(parts), drawn


def _parameter_table(rows: list[list[str]], label: str) -> str:
    return table(["parameter", "value", "prior", "unit", "from data"], rows, "parameters", label)


def _parameter(name: str, entry: dict, prior, at_zero: bool = False) -> list[str]:
    share = float(entry["from_data"] or 0.0)
    value = '0 <span class="quiet">at its bound</span>' if at_zero else plus_minus(entry["value"], entry["std"])
    held = ' <span class="quiet">held</span>' if entry.get("held") else ""
    meter = f'<span class="meter" style="--share:{100 * share:.0f}%" aria-hidden="true"></span>{share:.2f}'
    return [breaking(name), value + held, number(prior) if prior is not None else "–", unit_of(entry["unit"]) or "–", meter]


# ---- the bodies



def bodies(fit: Fit, diagnosis: Diagnosis) -> tuple[str, str, list]:
    """The bodies as ellipsoids on the robot, at the middle of its motion."""
    robot = fit.model.robot
    q = [piece.q[piece.core] for piece in diagnosis.view.motion.pieces]
    low, high = np.min([x.min(0) for x in q], 0), np.max([x.max(0) for x in q], 0)
    placed = solids.frames(robot, (low + high) / 2)
    now, before = solids.solids(robot, fit.pi, placed), solids.solids(robot, fit.prior, placed)
    found, rows = [], []
    for b, (body, one, other) in enumerate(zip(robot.bodies, now, before)):
        mass, prior = float(fit.pi[b, 0]), float(fit.prior[b, 0])
        found.append({"name": body.name, "kind": body.kind, "words": f"mass {number(mass)} kg", "identified": one, "prior": other})
        triple = lambda values: ", ".join(number(v, 3) for v in values)  # noqa: E731
        semi = triple(sorted(one.axes)[::-1]) if one else "not physically possible"
        rows.append([breaking(body.name), body.kind, number(mass), number(prior), triple(one.centre) if one else "–", semi, triple(sorted(other.axes)[::-1]) if other else "–"])
    chart = charts.bodies("solids", found, solids.skeleton(robot, placed))
    angles = ", ".join(f"{text(j)} {number(v, 3)} {'m' if slides else 'rad'}" for j, v, slides in zip(fit.joints, (low + high) / 2, robot.prismatic))
    body = (
        f"<p>Each body as the uniform ellipsoid of its mass, centre of mass and inertia, at the middle of the logged motion: {angles}.</p>{drawing(chart, kind='space')}"
        + table(["body", "kind", "mass [kg]", "prior [kg]", "centre x, y, z [m]", "semi-axes [m]", "prior [m]"], rows, "bodies", "ellipsoids of the bodies")
        + '<p class="quiet">Filled: identified. Lines: prior. What the data cannot see of a shape is free within what the prior allows: a needle is a shape that these logs do not determine, and is cut where it leaves the box.</p>'
    )
    return "Bodies", body, [chart]


# ---- the provenance



def provenance(fit: Fit, document: dict) -> tuple[str, str, list]:
    """Everything needed to find the same again."""
    said = results.document(fit)
    path = fit.experiment.path
    logs = [
        [breaking(entry.get("log", "–")), text(entry.get("part", "–")), f"<code>{text(entry.get('sha256', '–'))}</code>", text(entry.get("samples", "–")), _span(entry)]
        for entry in document["logs"]
    ]
    versions = [[text(name), text(version)] for name, version in document["versions"].items()]
    seeds = ", ".join(f"{text(k)} {text(v)}" for k, v in said["seeds"].items()) or "none to set; a fit is not random, and what the diagnosis draws it draws with a fixed seed"
    command = f"sysid report {shlex.quote(str(path))}" if path else "sysid report EXPERIMENT"
    try:
        source = path.read_text(encoding="utf-8-sig") if path else ""
    except OSError:
        source = ""
    body = f"<h3>Command</h3><pre>{text(command)}</pre><h3>Logs</h3>" + table(["log", "part", "SHA-256", "samples", "piece"], logs, "logs", "logs")
    body += f"<h3>Versions</h3>{table(['package', 'version'], versions, label='versions')}<p>Seeds: {seeds}.</p>"
    certificate = fit.certificate
    body += f"<p>{fit.solution.iterations} iterations, {'converged' if fit.solution.converged else 'not converged'}; objective {number(fit.objective, 8)}{_squared(fit)}; certificate: stationarity {number(certificate.stationarity, 2)}, no other parameters can gain more than {number(certificate.gap, 2)}.</p>"
    body += f"<h3>Experiment</h3><pre>{text(source)}</pre>" if source else empty("The experiment file is not at hand.")
    return "Provenance", body, []


def _squared(fit: Fit) -> str:
    """The unit of the objective; none where joints that turn and joints that slide are summed."""
    slides = set(fit.model.robot.prismatic)
    return "" if len(slides) > 1 else f"{SPACE}N²" if True in slides else f"{SPACE}N²{SPACE}m²"


def _span(entry: dict) -> str:
    start, stop = entry.get("start"), entry.get("stop")
    if start is None and stop is None:
        return "whole"
    return f"{number(start) if start is not None else '0'} s to {'the end' if stop is None else f'{number(stop)} s'}"
