"""The page's frame; what stands in it is the report's. Its script and its style are the report's with some more of both."""

from __future__ import annotations

import html
from functools import cache

from ..report.script import SCRIPT as REPORT_SCRIPT
from ..report.style import STYLE as REPORT_STYLE
from .script import SCRIPT
from .style import STYLE


def shell(name: str, csrf: str, names: list[str] | None = None, number: int = 0) -> str:
    """The HTML of the empty page under the name of an experiment.

    Args:
        names: of all experiments that the studio was opened on; number: of this one among them.
    """
    title = html.escape(name)
    grey = "".join(f'<div class="bone" style="height:{height}rem"></div>' for height in (2, 6, 16, 10))
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="sysid-csrf" content="{html.escape(csrf)}">
<title>{title} · sysid studio</title>
<link rel="icon" href="data:,">
<link rel="stylesheet" href="/studio.css">
</head>
<body>
<a class="skip" href="#verdict">to the verdict</a>
<header class="top"><h1>{title}</h1><p class="quiet">What the model says, where it fails, what is missing. Every change is written to the experiment file.</p>{_others(names or [], number)}</header>
<nav aria-label="sections"><ul id="links"></ul></nav>
<main id="main" aria-busy="true">
<noscript><p class="empty">The studio needs JavaScript. <code>sysid report</code> writes a page that does without.</p></noscript>
<div id="notice" role="alert"></div>
<div id="waiting" aria-hidden="true">{grey}</div>
<div id="sections"></div>
</main>
<div id="bar" role="region" aria-label="work and steps">
<div class="work"><span id="status" role="status" aria-live="polite">connecting</span> <span id="share"></span><progress id="progress" max="1" value="0" aria-label="progress" hidden></progress></div>
<div class="buttons"><button type="button" id="cancel" hidden>cancel</button><button type="button" id="undo" disabled>undo</button><button type="button" id="redo" disabled>redo</button><a class="button" id="report" hidden download>report</a><a class="button" id="yaml" href="export/experiment.yaml" download>YAML</a></div>
</div>
<script src="/studio.js" defer></script>
</body>
</html>
"""


def _others(names: list[str], number: int) -> str:
    """The way to the other experiments; nothing where there are none."""
    if len(names) < 2:
        return ""
    links = "".join(f'<li><a href="/{k}/"{" aria-current=page" if k == number else ""}>{html.escape(name)}</a></li>' for k, name in enumerate(names))
    return f'<details class="experiments"><summary>another experiment ({len(names) - 1} beside this one)</summary><ul>{links}</ul></details>'


def script() -> str:
    """What makes the page move."""
    return REPORT_SCRIPT + SCRIPT


def style() -> str:
    """The look of the page."""
    return REPORT_STYLE + STYLE


@cache
def engine() -> bytes:
    """plotly.js."""
    from plotly.offline import get_plotlyjs

    return get_plotlyjs().encode()
