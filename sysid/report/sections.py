"""The sections of a page on one experiment: words and tables as HTML, charts as Plotly figures.

`sysid report` puts them into one file. Words come first, charts after; the place of a chart says
its name (`data-chart`). Every text that comes from a file or an experiment is escaped, by the
templates.
"""

from __future__ import annotations

from ..estimate import Fit
from .bodies import bodies
from .detectable import detectable
from .fitted import failures, torque
from .parameters import parameters
from .provenance import provenance
from .section import Section
from .steps import steps
from .suspects import suspects
from .verdict import verdict


def sections(fit: Fit, document: dict, history: list[dict]) -> dict[str, dict]:
    """The sections in the order of the page: {name: {"title", "html", "charts"}}.

    Args:
        document: of the diagnosis (`statement.document`). history: the steps made so far, oldest
            first; may be empty.
    """
    made: dict[str, Section] = {
        "verdict": verdict(fit, document),
        "torque": torque(fit, document),
        "steps": steps(fit, document, history),
        "failures": failures(fit, document),
        "suspects": suspects(document),
        "detectable": detectable(fit, document),
        "parameters": parameters(fit),
        "bodies": bodies(fit),
        "provenance": provenance(fit, document),
    }
    return {
        name: {"title": section.title, "html": section.html(), "charts": section.charts}
        for name, section in made.items()
    }
