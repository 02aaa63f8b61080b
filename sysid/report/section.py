"""A section of a page: what it shows, as plain data, and the template that shows it."""

from __future__ import annotations

from dataclasses import dataclass, field

from markupsafe import Markup

from .rendering import environment


@dataclass(frozen=True)
class Section:
    """One section.

    Attributes:
        title: its heading. template: name of its file in `templates/`, without the ending.
        values: of the template's variables.
        charts: as `charts.chart` makes them, in the order of their places.
    """

    title: str
    template: str
    values: dict
    charts: list = field(default_factory=list)

    def html(self) -> Markup:
        """The words, the tables and the places of the charts."""
        template = environment("report").get_template(f"report/{self.template}.html")
        return Markup(template.render(**self.values))
