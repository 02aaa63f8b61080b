"""Files that are written whole or not at all, and together where they belong together."""

import json
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from .errors import SysidError
from .unfinished import beside


def folder(out: str | Path) -> Path:
    """Create a run folder, and make sure that it can be written before any work is done.

    Raises:
        SysidError: it cannot.
    """
    path = Path(out)
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = beside(path / "probe")
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise SysidError(f"the run folder cannot be written ({error.strerror})", where=str(path), do="give another with --out") from None
    return path


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` fill a temporary file beside `path`, then rename it. Raises SysidError where the disk refuses."""
    write_together({path: write})


def write_together(files: dict[Path, Callable[[Path], object]], *, without: tuple[Path, ...] = ()) -> None:
    """Write several files or none: each is filled beside its place, and only when all are whole and on the disk they are
    renamed, in this order. A file keeps the mode of the one in whose place it comes. Files of `without`, which the new ones make
    untrue, are removed before: whoever is killed in between leaves none of them beside new ones.

    Raises:
        SysidError: the disk refuses; everything is as it was.
    """
    temporary = {path: beside(path) for path in files}
    path = None
    try:
        for path, write in files.items():
            write(temporary[path])
            _settle(temporary[path], path)
        for path in without:
            path.unlink(missing_ok=True)
        for path, filled in temporary.items():
            os.replace(filled, path)
    except OSError as error:
        said = error.strerror or str(error).splitlines()[0]
        raise SysidError(f"cannot be written ({said})", where=str(path), do="free the disk or give another --out") from None
    finally:
        for filled in temporary.values():
            with suppress(OSError):
                filled.unlink(missing_ok=True)


def parquet(table) -> Callable[[Path], None]:
    """What writes a table of Polars to a file, for `write_atomically`."""
    import polars as pl

    def write(path: Path) -> None:
        try:
            table.write_parquet(path)
        except pl.exceptions.PolarsError as error:  # a full disk comes as an error of computation
            raise OSError(str(error)) from None

    return write


ROWS = 2**15  # of a table that are written as one: a few dozen such stand in memory meanwhile


def sunk(tables: Callable[[], Iterator]) -> Callable[[Path], None]:
    """As `parquet`, of tables of Polars made one after another, each when it is asked for: the whole is never in memory.

    It is no scan of files, of which Polars reads hundreds of row groups ahead of what it writes (its issues 28312 and 28569).
    """
    import polars as pl
    from polars.io.plugins import register_io_source

    def source(columns, *_) -> Iterator:
        for table in tables():
            yield from (table if columns is None else table.select(columns)).iter_slices(ROWS)

    def write(path: Path) -> None:
        try:
            whole = register_io_source(source, schema=next(tables()).schema)
            whole.sink_parquet(path, compression_level=1, row_group_size=ROWS)  # of zstd: noise is no smaller at a higher one
        except pl.exceptions.PolarsError as error:
            raise OSError(str(error)) from None

    return write


def _settle(filled: Path, place: Path) -> None:
    """Bring a file to the disk, with the mode and the owner of the one that it replaces."""
    with filled.open("r+b") as file:
        os.fsync(file.fileno())
    try:
        before = place.stat()
    except OSError:
        return
    filled.chmod(stat.S_IMODE(before.st_mode))
    if hasattr(os, "chown") and (before.st_uid, before.st_gid) != (os.getuid(), os.getgid()):
        with suppress(OSError):  # only root may give a file away
            os.chown(filled, before.st_uid, before.st_gid)


def write_json(path: Path, value) -> None:
    """Write a JSON document, strictly (no NaN)."""
    text = json.dumps(value, indent=1, allow_nan=False) + "\n"
    write_atomically(path, lambda p: p.write_text(text, encoding="utf-8"))
