"""Parquet: only the columns that are asked for are read, one at a time."""

import polars as pl

from ..errors import LogError
from .table import Table


class ParquetTable(Table):
    """Columns by name."""

    def __init__(self, path):
        self.path = path
        try:
            self._schema = pl.read_parquet_schema(path)
        except (pl.exceptions.PolarsError, OSError) as error:
            raise LogError(f"not a readable Parquet file ({str(error).splitlines()[0]})", where=str(path)) from None
        self.names = list(self._schema)

    def load(self, names):
        out = {}
        for name in names:
            if not self._schema[name].is_numeric():
                raise LogError(f"column {name!r} holds {self._schema[name]}", where=str(self.path), allowed="numbers")
            try:
                # column by column, so that the file never stands in memory beside the arrays
                values = pl.read_parquet(self.path, columns=[name], use_statistics=False)[name].cast(pl.Float64)
            except (pl.exceptions.PolarsError, OSError) as error:
                raise LogError(f"the Parquet file is corrupt ({str(error).splitlines()[0]})", where=f"{self.path} column {name!r}") from None
            if values.null_count():
                raise LogError("a value is missing", where=f"{self.path} column {name!r} row {int(values.is_null().arg_max())}", do="leave the row out")
            out[name] = values.to_numpy()
        return out
