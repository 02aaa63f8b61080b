"""CSV: with or without a header; comma, semicolon, tab or space between numbers."""

import re
import warnings

import polars as pl

from ..errors import LogError, SysidWarning
from .table import Table

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?(nan|inf|infinity)", re.IGNORECASE)


class CsvTable(Table):
    """Columns by the names in the header; without one they are named 0, 1, 2 … and found by number."""

    def __init__(self, path):
        self.path = path
        with path.open("rb") as file:
            try:
                first = file.readline(1_000_000).decode("utf-8-sig").rstrip("\r\n")
            except UnicodeDecodeError:
                raise LogError("not text", where=str(path), do="give a CSV file") from None
        if not first.strip():
            raise LogError("the file is empty, or its first line is", where=str(path))
        self._separator = max(",;\t ", key=first.count) if any(s in first for s in ",;\t ") else ","
        cells = [cell.strip().strip('"') for cell in first.split(self._separator)]
        self._header = not all(_NUMBER.fullmatch(cell) or not cell for cell in cells)
        self.names = cells if self._header else [str(k) for k in range(len(cells))]
        if self._header and (twice := sorted({c for c in cells if cells.count(c) > 1})):
            raise LogError(f"two columns are named {twice[0]!r}", where=str(path), do="rename one")

    def load(self, names):
        positions = [self.names.index(name) for name in names]
        # polars wants ascending positions and each once; the header is skipped because we name the columns
        wanted = sorted(set(positions))
        try:
            try:
                frame = self._frame(wanted, {f"column_{k + 1}": pl.Float64 for k in range(len(self.names))})
            except pl.exceptions.PolarsError:
                frame = self._frame(wanted, None)  # as text, to find the cell that is no number
        except (pl.exceptions.PolarsError, OSError) as error:
            raise LogError(f"cannot be read as CSV ({str(error).splitlines()[0]})", where=str(self.path)) from None
        if self._last_row_is_short() and frame.height:
            warnings.warn(SysidWarning(f"{self.path.name}: the last row is truncated and was dropped"), stacklevel=2)
            frame = frame.head(frame.height - 1)
        out = {}
        for position, column in zip(wanted, list(frame.columns)):
            name, cells = self.names[position], frame.drop_in_place(column)
            values = cells if cells.dtype == pl.Float64 else cells.str.strip_chars().cast(pl.Float64, strict=False)
            bad = values.is_null()
            if bad.any():
                row = int(bad.arg_max())
                raise LogError(f"{cells[row]!r} is no number", where=f"{self.path} line {row + 1 + self._header} column {name!r}", do="correct the row or leave it out")
            out[name] = values.to_numpy()
        return {name: out[name] for name in names}

    def _frame(self, wanted, schema) -> pl.DataFrame:
        return pl.read_csv(
            self.path, has_header=False, skip_rows=int(self._header), separator=self._separator, columns=wanted,
            infer_schema=False, schema_overrides=schema,
        )  # fmt: skip

    def _last_row_is_short(self) -> bool:
        with self.path.open("rb") as file:
            file.seek(0, 2)
            size = file.tell()
            file.seek(max(0, size - 1_000_000))
            lines = [line for line in file.read().decode("utf-8", errors="replace").splitlines() if line.strip()]
        return bool(lines) and len(lines[-1].split(self._separator)) < len(self.names)


