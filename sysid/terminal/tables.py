"""Tables and the numbers in them, as wide as the terminal."""

import re
import shutil

from rich.console import Console
from rich.markup import escape

from ..same_samples import NOT_HELD_OUT
from ..statement import tables, text


def table(title: str, heads: list[str], rows: list[list[str]]) -> None:
    """A table in the width of the terminal, the names on its left whole."""
    print("\n".join([title, *tables.fitted(heads, rows, 1, terminal_width())]))


def percent(share: float | None) -> str:
    """A share in per cent; a dash for none."""
    return "-" if share is None else f"{100 * share:.2f} %"


def number(value: float | None) -> str:
    """A number with four digits; a dash for none."""
    return "-" if value is None else f"{value:.4g}"


def four(value: float | None) -> str:
    """A number with four decimals; a dash for none."""
    return "-" if value is None else f"{value:.4f}"


def terminal_width() -> int:
    """Columns of the terminal."""
    return shutil.get_terminal_size().columns


_KEY = re.compile(r"\b(robot|data|preprocess|model|prior|solver|actuator)\.([a-z]\w*)")


def show_notices(document: dict, before=()) -> None:
    """What was decided for the user, each on a line; where a key is named, how it stands in the file.

    Args:
        before: notices that another command told of the same run; what makes an error none is told again.
    """
    console, new = Console(), [notice for notice in document["notices"] if notice not in before or NOT_HELD_OUT in notice]
    if old := len(document["notices"]) - len(new):
        new.append(f"{old} more on these logs and their fit {'are' if old > 1 else 'is'} as told before: see fit.json in the run folder")
    for notice in new:
        lines = escape("\n".join(text.wrapped(f"note {notice}", terminal_width(), "  "))).removeprefix("note")
        console.print(f"[yellow]note[/yellow]{lines}", soft_wrap=True, highlight=False)
    if key := _KEY.search(" ".join(new)):
        words = f"a key such as {key[0]} stands in the experiment file as `{key[2]}:` under `{key[1]}:`"
        print("\n".join(text.wrapped(f"  {words}", terminal_width(), "  ")))
