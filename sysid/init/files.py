"""What names after `sysid init` mean: the tables of logs, without what lies beside them."""

from __future__ import annotations

from pathlib import Path

from .. import datasets
from ..errors import LogError
from ..readers import listed, open_table
from ..readers.listing import ending
from ..readers.table import Table
from .columns import found


def opened(names: list[str], topic: str | None) -> tuple[dict[str, Table], list[str]]:
    """The table of every log that the names mean: files, folders, patterns, public logs; absolute
    paths but of these. And what to say of text among them that is no table.

    Raises:
        LogError: one cannot be opened.
    """
    out, passed, wrong = {}, [], None
    for name in names:
        if (dataset := datasets.reference(name)) is not None:
            out[name] = dataset.open(dataset.locate())
            continue
        every = listed(str(Path(name).absolute()), Path("/"))
        for path in every:
            try:
                out[path] = open_table(Path(path).resolve(), topic)
            except LogError as error:
                # notes of a day lie beside its logs
                if ending(Path(path)) != ".txt" or every == [path]:
                    raise
                wrong = error
                passed.append(f"{error}; it was passed over")
    if wrong and not out:
        raise wrong
    return out, passed


def logs_among(
    tables: dict[str, Table], stated: list[str], joints: list[str]
) -> tuple[dict[str, Table], list[str]]:
    """The tables without those of a folder or a pattern that name no joint's angle, where others
    do. And what to say of these.

    Args:
        stated: names as given; a file that was named by itself is a log whatever it holds.
    """
    alone = {*stated, *(str(Path(name).absolute()) for name in stated)}
    logs = {
        name: table
        for name, table in tables.items()
        if name in alone or found(table, joints).get("position")
    }
    if not logs:
        return tables, []
    passed = [name for name in tables if name not in logs]
    return logs, [f"{name}: no column looks like an angle; it was passed over" for name in passed]
