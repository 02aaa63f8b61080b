"""Numbers as words, and the few elements that every section of a page is made of. Whatever is no number is escaped."""

from __future__ import annotations

import html
import math
import re

from ..estimate import Fit

SPACE = "\u00a0"  # between a number and what belongs to it: no line ends there


def text(value) -> str:
    """Any value as text of a page."""
    return html.escape(str(value), quote=True)


def breaking(name) -> str:
    """A name as text that may go on in the next line after an underscore, a dot or a slash."""
    return re.sub(r"(?<=\w)([_./])", r"\1<wbr>", text(name))


def number(value, digits: int = 4) -> str:
    """A number as text; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.{digits}g}".replace("-", "−")


def level(value) -> str:
    """An error as text, always to four digits, so that levels can be compared by eye."""
    if value is None or not math.isfinite(value) or not 1e-3 <= abs(value) < 1e3:
        return number(value)
    return f"{value:#.4g}".rstrip(".").replace("-", "−")


def plus_minus(value, std, digits: int = 4) -> str:
    """A value with its standard deviation, rounded to two digits of the latter."""
    if value is None or not math.isfinite(value):
        return "–"
    if std is None or not math.isfinite(std) or std <= 0:
        return number(value, digits)
    places = 1 - int(math.floor(math.log10(std)))
    if -2 <= places <= 6 and abs(value) < 1e6:
        places = max(places, 0)
        return f"{round(value, places) + 0.0:.{places}f}{SPACE}±{SPACE}{std:.{places}f}".replace("-", "−")  # + 0.0: no minus before a zero
    return f"{number(value, digits)}{SPACE}±{SPACE}{number(std, 2)}"


def unit_of(word: str) -> str:
    """A unit as text behind a number, escaped; nothing where there is none."""
    return "" if word in ("", "1") else SPACE + text(raised(word))


def raised(unit: str) -> str:
    """A unit with its powers as they are printed, in one piece."""
    return unit.replace("^2", "²").replace("^3", "³").replace(" ", SPACE)


def quantity(variable: str, fit: Fit) -> str:
    """A variable of the diagnosis (`qd_hip`) in words; itself where it is none of the motion's."""
    for joint, slides in zip(fit.joints, fit.model.robot.prismatic):
        known = {"q": "position" if slides else "angle", "qd": "speed", "qdd": "acceleration", "load": "load"}
        for symbol, word in known.items():
            if variable == f"{symbol}_{joint}":
                return f"{word} of {joint}"
    return variable


def units(fit: Fit) -> dict[str, tuple[str, str]]:
    """Of each joint the unit of what it exerts and of where it is."""
    return {joint: ("N", "m") if slides else ("N m", "rad") for joint, slides in zip(fit.joints, fit.model.robot.prismatic)}


def drawing(chart: dict, caption: str = "", kind: str = "") -> str:
    """The place of a chart, with what a screen reader says of it."""
    below = f"<figcaption>{caption}</figcaption>" if caption else ""
    keys = ' tabindex="0" aria-keyshortcuts="ArrowLeft ArrowRight + - 0"' if chart["link"] else ""
    return (
        f'<figure class="chart {kind}" data-chart="{chart["id"]}" aria-label="{text(chart["label"])}"{keys} style="--height:{chart["height"]}px">'
        f'<div class="plot"><p class="waiting">drawing…</p></div>{below}</figure>'
    )


def table(heads: list[str], rows: list[list[str]], kind: str = "", label: str = "") -> str:
    """A table that scrolls inside its box; heads and cells are HTML already."""
    head = "".join(f'<th scope="col">{h}</th>' for h in heads)
    body = "".join("<tr>" + "".join(f'<th scope="row">{c}</th>' if k == 0 else f"<td>{c}</td>" for k, c in enumerate(row)) + "</tr>" for row in rows)
    return f'<div class="scroll" tabindex="0" role="region" aria-label="{text(label)}"><table class="{kind}"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def empty(words: str) -> str:
    """What stands where there is nothing to show."""
    return f'<p class="empty">{words}</p>'


def percentage(share, se=None) -> str:
    """A share, with its standard error, in per cent."""
    if share is None or not math.isfinite(share):
        return "–"
    places = 0 if abs(share) >= 0.0995 else 1
    said = lambda value: f"{round(100 * value, places) + 0.0:.{places}f}"  # noqa: E731 - no minus before a zero
    return f"{said(share)}{'' if se is None or not math.isfinite(se) else f'{SPACE}±{SPACE}{said(se)}'}{SPACE}%".replace("-", "−")


def chance(probability: float) -> str:
    """A probability, in per cent: as many draws tell it, it is never nothing."""
    return f"&lt;{SPACE}1{SPACE}%" if probability < 0.005 else f"{round(100 * probability)}{SPACE}%"
