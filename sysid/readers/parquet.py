"""Parquet: only the columns that are asked for are read, one at a time."""

import os
from contextlib import contextmanager

import polars as pl

from ..errors import LogError
from .table import Table

# on corrupt pages Polars panics; what it raises then is no Exception, and Rust has written to standard error
_CORRUPT = (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError)


class ParquetTable(Table):
    """Columns by name."""

    def __init__(self, path):
        self.path = path
        try:
            with _silent():
                self._schema = pl.read_parquet_schema(path)
        except _CORRUPT as error:
            raise self._unreadable(error) from None
        self.names = list(self._schema)

    def _unreadable(self, error: BaseException, name: str | None = None) -> LogError:
        said = (str(error).splitlines() or [type(error).__name__])[0]
        where = str(self.path) if name is None else f"{self.path} column {name!r}"
        return LogError(f"not a readable Parquet file ({said})", where=where, do="write it again")

    def load(self, names):
        out = {}
        for name in names:
            if not self._schema[name].is_numeric():
                raise LogError(f"column {name!r} holds {self._schema[name]}", where=str(self.path), allowed="numbers")
            try:
                # column by column, so that the file never stands in memory beside the arrays
                with _silent():
                    values = pl.read_parquet(self.path, columns=[name], use_statistics=False)[name]
                    values = values if values.dtype.is_integer() else values.cast(pl.Float64)
            except _CORRUPT as error:
                raise self._unreadable(error, name) from None
            if values.null_count():
                raise LogError(
                    "a value is missing", where=f"{self.path} column {name!r} row {int(values.is_null().arg_max())}", do="leave the row out"
                )
            out[name] = values.to_numpy()
        return out


@contextmanager
def _silent():
    """Keeps native code off standard error."""
    kept, nothing = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nothing)
