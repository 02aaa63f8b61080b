"""One self-contained HTML file of a diagnosed experiment: words and tables first, charts drawn when they come into view.

Nothing is loaded from anywhere. The page carries a content security policy that allows its own two scripts, by their
hashes, and no connection: a text of a log that looks like markup is escaped, and would not run were it not.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
from pathlib import Path

from .. import results
from ..diagnose.diagnosis import Diagnosis
from ..estimate import Fit
from . import sections as parts
from .script import SCRIPT
from .style import STYLE

_SHORT = {
    "verdict": "Verdict", "torque": "Torque", "steps": "Steps", "failures": "Where", "suspects": "Suspects", "detectable": "Could show", "parameters": "Parameters",
    "bodies": "Bodies", "provenance": "Provenance",
}  # fmt: skip


def write(fit: Fit, diagnosis: Diagnosis, document: dict, history: list[dict], path: Path) -> Path:
    """Write the report of a diagnosed experiment as one HTML file.

    Raises:
        SysidError: the file cannot be written.
    """
    text = page(fit.experiment.name, parts.sections(fit, diagnosis, document, history))
    results.write_atomically(path, lambda p: p.write_text(text, encoding="utf-8"))
    return path


def page(name: str, made: dict[str, dict]) -> str:
    """The HTML of sections ({name: {"title", "html", "charts"}}) under the name of an experiment."""
    from plotly.offline import get_plotlyjs

    engine = get_plotlyjs()
    if "</script" in engine.lower():
        engine = engine.replace("</script", "<\\/script")
    policy = (
        f"default-src 'none'; script-src '{_hash(SCRIPT)}' '{_hash(engine)}' 'unsafe-eval'; style-src 'unsafe-inline'; img-src data: blob:; "
        "worker-src blob:; base-uri 'none'; form-action 'none'"
    )
    title = html.escape(name)
    links = "".join(f'<li><a href="#{key}">{_SHORT.get(key, html.escape(key))}</a></li>' for key in made)
    body = "".join(f'<section id="{key}" aria-labelledby="{key}-title"><h2 id="{key}-title">{html.escape(section["title"])}</h2>{section["html"]}</section>\n' for key, section in made.items())
    figures = "\n".join(
        f'<script type="application/json" id="figure-{chart["id"]}">{embedded({"link": chart["link"], "figure": chart["figure"]})}</script>'
        for section in made.values() for chart in section["charts"]
    )  # fmt: skip
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="referrer" content="no-referrer">
<title>{title} · sysid report</title>
<link rel="icon" href="data:,">
<style>{STYLE}</style>
<noscript><style>figure.chart, .tools {{ display: none; }}</style></noscript>
</head>
<body>
<a class="skip" href="#verdict">to the verdict</a>
<header class="top"><h1>{title}</h1><p class="quiet">What the model says, where it fails, what is missing. Written by sysid {html.escape(results.versions()["sysid"])}.</p></header>
<nav aria-label="sections"><ul>{links}</ul></nav>
<main>
<noscript><p class="empty">Charts need JavaScript, which is off here. The words and tables below hold the findings.</p></noscript>
{body}</main>
<footer>One file, no network: everything shown is in it. Charts by plotly.js (MIT licence).</footer>
{figures}
<script type="text/plain" id="plotly">{engine}</script>
<script>{SCRIPT}</script>
</body>
</html>
"""


def embedded(value) -> str:
    """A value as JSON that cannot end the script element that holds it. NaN is refused."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def _hash(script: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
