"""Parquet: only the columns that are asked for are read, one at a time. A column of lists of one length is a matrix."""

import copy

import numpy as np
import polars as pl

from ..errors import LogError
from ..silence import silenced
from . import lerobot
from .table import Table, most_bytes

# whole numbers stay whole, as a clock in ns has more digits than a float; NumPy has none of 128 bits
_WHOLE = (pl.Int8, pl.Int16, pl.Int32, pl.Int64, pl.UInt8, pl.UInt16, pl.UInt32, pl.UInt64)
# on corrupt pages Polars panics; what it raises then is no Exception, and Rust has written to standard error
_CORRUPT = (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError)


class ParquetTable(Table):
    """Columns by name; of a LeRobot data set, the elements of a list column also by theirs, `observation.state.elbow`."""

    def __init__(self, path):
        self.path = path
        self._part: tuple[int, int] | None = None  # first row and number of rows, where not all are meant
        try:
            with silenced():
                self._schema = pl.read_parquet_schema(path)
                rows = pl.scan_parquet(path).select(pl.len()).collect().item() if self._schema else 0
                if 8 * rows > most_bytes(path):
                    raise OSError(f"{rows} rows in a file of {path.stat().st_size} bytes")
                self._widths = {name: width for name, kind in self._schema.items() if (width := self._width(name, kind))}
        except _CORRUPT as error:
            raise self._unreadable(error) from None
        self.rows = rows
        self.names, self._elements = [], {}
        for name in self._schema:
            self.names.append(name)
            parts = [f"{name}[{k}]" for k in range(self._widths.get(name, 1))] if self.width(name) > 1 else []
            self.names += parts
            self._elements |= {part: (name, k) for k, part in enumerate(parts)}
        own = {name: e for name, e in self._said().items() if len(e) == self._widths.get(name)}
        for name, elements in own.items():
            named = {f"{name}.{element}": (name, k) for k, element in enumerate(elements)}
            self._elements |= {part: at for part, at in named.items() if part not in self.names}
        self.names += [part for part in self._elements if part not in self.names]
        if usual := lerobot.usual(self.names, own):
            self.usual, self.clock = usual, "s"

    def _said(self) -> dict[str, list[str]]:
        """The names of elements that the data set gives, where the file has lists at all."""
        return lerobot.element_names(self.path) if self._widths else {}

    def _width(self, name, kind) -> int | None:
        """The length of a column's lists of numbers, by its type or its first row; None for any other column."""
        if isinstance(kind, pl.Array):
            return kind.shape[0] if len(kind.shape) == 1 and kind.inner.is_numeric() else None
        if not isinstance(kind, pl.List) or not kind.inner.is_numeric():
            return None
        first = pl.scan_parquet(self.path).select(pl.col(name).list.len()).head(1).collect()
        return first.item() if first.height else None

    def width(self, name):
        return self._widths.get(name, 1) or 1

    def _unreadable(self, error: BaseException, name: str | None = None) -> LogError:
        said = (str(error).splitlines() or [type(error).__name__])[0]
        where = str(self.path) if name is None else f"{self.path} column {name!r}"
        return LogError(f"not a readable Parquet file ({said})", where=where, do="write it again")

    def between(self, first: int, last: int) -> "ParquetTable":
        """The rows from `first` up to, not including, `last`: only the row groups that hold them are read."""
        part = copy.copy(self)
        part._part, part.rows = (first, last - first), last - first
        return part

    def load(self, names, empty=()):
        out, held = {}, {}
        for name in names:
            column, k = self._elements.get(name, (name, None))
            if column not in held:
                held[column] = self._column(column, column in empty)
            out[name] = held[column] if k is None else held[column][:, k]
        return out

    def _column(self, name, empty: bool = False) -> np.ndarray:
        kind, width = self._schema[name], self._widths.get(name)
        if not (kind.is_numeric() or width):
            raise LogError(f"column {name!r} holds {kind}", where=str(self.path), allowed="numbers, or lists of numbers of one length")
        try:
            # column by column, so that the file never stands in memory beside the arrays
            with silenced():
                values = self._values(name)
                if width or not empty:
                    self._check_null(name, values, 1)
                if isinstance(kind, pl.List) and (other := values.list.len() != width).any():
                    row = int(other.arg_max()) + (self._part or (0,))[0]
                    raise LogError(
                        f"a list of {int(values.list.len()[int(other.arg_max())])} numbers where the first row has {width}",
                        where=f"{self.path} column {name!r} row {row}", do="leave the row out",
                    )  # fmt: skip
                values = values.explode() if width else values
                values = values if values.dtype in _WHOLE else values.cast(pl.Float64)
        except _CORRUPT as error:
            raise self._unreadable(error, name) from None
        if width or not empty:
            self._check_null(name, values, width or 1)
        out = values.to_numpy()
        return out.reshape(-1, width) if width and width > 1 else out

    def _values(self, name) -> pl.Series:
        if self._part is None:
            return pl.read_parquet(self.path, columns=[name], use_statistics=False)[name]
        return pl.scan_parquet(self.path, use_statistics=False).select(name).slice(*self._part).collect()[name]

    def _check_null(self, name, values, width: int) -> None:
        if values.null_count():
            row = int(values.is_null().arg_max()) // width + (self._part or (0,))[0]
            raise LogError("a value is missing", where=f"{self.path} column {name!r} row {row}", do="leave the row out")
