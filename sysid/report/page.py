"""One self-contained HTML file of a diagnosed experiment: words first, charts when they come near.

Nothing is loaded from anywhere. The page carries a content security policy that allows its own two
scripts, by their hashes, and no connection: a text of a log that looks like markup is escaped, and
would not run were it not.
"""

from __future__ import annotations

import base64
import hashlib
import re
from pathlib import Path

from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup

from .. import fit_document, whole_files
from ..estimate import Fit
from . import rendering
from . import sections as parts

_SHORT = {
    "verdict": "Verdict", "torque": "Torque", "steps": "Steps", "failures": "Where",
    "suspects": "Suspects", "detectable": "Could show", "parameters": "Parameters",
    "bodies": "Bodies", "provenance": "Provenance",
}  # fmt: skip


def write(fit: Fit, document: dict, history: list[dict], path: Path) -> Path:
    """Write the report of a diagnosed experiment as one HTML file.

    Raises:
        SysidError: the file cannot be written.
    """
    text = page(fit.experiment.name, parts.sections(fit, document, history))
    whole_files.write_atomically(path, lambda p: p.write_text(text, encoding="utf-8"))
    return path


def page(
    name: str, made: dict[str, dict], *, template: str = "page", short: dict[str, str] | None = None
) -> str:
    """The HTML of sections, {name: {"title", "html", "charts"}}, under an experiment's name.

    Args:
        template: name of the page's file, without the ending. short: what links call sections.
    """
    from plotly.offline import get_plotlyjs

    # what would end the element that holds it
    engine = re.sub("<(?=/script)", r"<\\", get_plotlyjs(), flags=re.IGNORECASE)
    script = rendering.script()
    policy = (
        f"default-src 'none'; script-src '{_hash(script)}' '{_hash(engine)}' 'unsafe-eval'; "
        "style-src 'unsafe-inline'; img-src data: blob:; worker-src blob:; base-uri 'none'; "
        "form-action 'none'"
    )
    return rendering.environment("report").get_template(f"report/{template}.html").render(
        name=name, sections=made, short=_SHORT if short is None else short, policy=policy,
        embedded=embedded,
        version=fit_document.versions()["sysid"], style=rendering.style(), script=script,
        engine=Markup(engine),
    )  # fmt: skip


def embedded(value) -> Markup:
    """A value as JSON that cannot end the script element that holds it. NaN is refused."""
    return htmlsafe_json_dumps(value, allow_nan=False, separators=(",", ":"), ensure_ascii=False)


def _hash(script: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
