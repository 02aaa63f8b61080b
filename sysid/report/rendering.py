"""Templates, styles and scripts of the pages: files beside the modules, put together here.

Templates are Jinja2's with autoescape: whatever a page shows is escaped unless a template made it.
A variable that is not there is an error. Static files are joined in the order given; nothing is
built beforehand.
"""

from __future__ import annotations

from functools import cache
from importlib import resources

from jinja2 import Environment, PackageLoader, PrefixLoader, StrictUndefined
from markupsafe import Markup

from .words import pieces

_SCRIPTS = ("theme.js", "time.js", "take.js", "charts.js", "paper.js")
_STYLES = ("theme.css", "page.css", "sections.css", "narrow.css", "paper.css")


@cache
def environment(*packages: str) -> Environment:
    """The templates of packages of the project, each under its name: `report/page.html`."""
    places = {name: PackageLoader(f"sysid.{name}") for name in packages}
    made = Environment(
        loader=PrefixLoader(places),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["pieces"] = pieces
    return made


def static(package: str, names: tuple[str, ...]) -> Markup:
    """Static files of a package of the project, one after another.

    They are part of the program, as the templates are: a page holds them as they stand.
    """
    folder = resources.files(f"sysid.{package}") / "static"
    return Markup("".join((folder / name).read_text(encoding="utf-8") for name in names))


@cache
def script() -> Markup:
    """What makes a report move."""
    return static("report", _SCRIPTS)


@cache
def style() -> Markup:
    """The look of a report."""
    return static("report", _STYLES)
