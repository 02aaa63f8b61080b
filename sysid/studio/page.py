"""The page's frame; what stands in it is the report's. Its script and its style are the report's with some more of both."""

from __future__ import annotations

from functools import cache

from markupsafe import Markup

from ..report import rendering

_SCRIPTS = (
    "asking.js", "standing.js", "workspace.js", "drawn.js", "cursor.js", "brush.js", "sections.js",
    "remedies.js", "begin.js",
)  # fmt: skip
_STYLES = ("studio.css", "joint.css")


def shell(name: str, csrf: str, names: list[str] | None = None, number: int = 0) -> str:
    """The HTML of the empty page under the name of an experiment.

    Args:
        names: of all experiments that the studio was opened on; number: of this one among them.
    """
    page = rendering.environment("report", "studio").get_template("studio/studio.html")
    return page.render(name=name, csrf=csrf, names=names or [], number=number)


@cache
def script() -> Markup:
    """What makes the page move."""
    return rendering.script() + rendering.static("studio", _SCRIPTS)


@cache
def style() -> Markup:
    """The look of the page."""
    return rendering.style() + rendering.static("studio", _STYLES)


@cache
def engine() -> bytes:
    """plotly.js."""
    from plotly.offline import get_plotlyjs

    return get_plotlyjs().encode()
