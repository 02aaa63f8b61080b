"""Where a result comes from: everything needed to find the same again."""

from __future__ import annotations

import shlex

from .. import fit_document
from ..estimate import Fit
from .section import Section
from .words import SPACE, number


def provenance(fit: Fit, document: dict) -> Section:
    """Command, logs, versions, seeds, the certificate and the experiment file."""
    path, certificate = fit.experiment.path, fit.certificate
    try:
        source = path.read_text(encoding="utf-8-sig") if path else ""
    except OSError:
        source = ""
    values = {
        "command": f"sysid report {shlex.quote(str(path)) if path else 'EXPERIMENT'}",
        "logs": [
            {key: entry.get(key, "–") for key in ("log", "part", "sha256", "samples")}
            | {"piece": _span(entry)}
            for entry in document["logs"]
        ],
        "versions": list(document["versions"].items()),
        "seeds": [f"{k} {v}" for k, v in fit_document.document(fit)["seeds"].items()],
        "iterations": fit.solution.iterations,
        "converged": fit.solution.converged,
        "objective": number(fit.objective, 8) + _squared(fit),
        "stationarity": number(certificate.stationarity, 2),
        "gap": number(certificate.gap, 2),
        "source": source,
    }
    return Section("Provenance", "provenance", values)


def _squared(fit: Fit) -> str:
    """The unit of the objective; none where joints that turn and joints that slide are summed."""
    slides = set(fit.model.robot.prismatic)
    if len(slides) > 1:
        return ""
    return f"{SPACE}N²" if True in slides else f"{SPACE}N²{SPACE}m²"


def _span(entry: dict) -> str:
    start, stop = entry.get("start"), entry.get("stop")
    if start is None and stop is None:
        return "whole"
    begin = "0" if start is None else number(start)
    return f"{begin} s to {'the end' if stop is None else f'{number(stop)} s'}"
