"""The sections of a page on one experiment, each its words and tables as HTML and its charts as Plotly figures.

`sysid report` puts them into one file. Words come first, charts after; a chart's place in the HTML is
`<figure class="chart" data-chart="ID">`. Every text that comes from a file or an experiment is escaped.
"""

from __future__ import annotations

from markupsafe import Markup

from ..diagnose.diagnosis import Diagnosis
from ..estimate import Fit
from . import detectable, fitted, identified, suspects, verdict


def sections(fit: Fit, diagnosis: Diagnosis, document: dict, history: list[dict]) -> dict[str, dict]:
    """The sections in the order of the page: {name: {"title", "html", "charts"}}.

    Args:
        document: of the diagnosis (`statement.document`). history: the steps made so far, oldest first; may be empty.
    """
    made = {
        "verdict": verdict.verdict(fit, diagnosis, document),
        "torque": fitted.torque(fit, document),
        "steps": fitted.steps(fit, diagnosis, document, history),
        "failures": fitted.failures(fit, document),
        "suspects": suspects.suspects(diagnosis, document),
        "detectable": detectable.detectable(fit, document),
        "parameters": identified.parameters(fit),
        "bodies": identified.bodies(fit, diagnosis),
        "provenance": identified.provenance(fit, document),
    }
    return {name: {"title": title, "html": Markup(text), "charts": drawn} for name, (title, text, drawn) in made.items()}
