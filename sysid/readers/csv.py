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
        if "\0" in first:
            raise LogError("not text", where=str(path), do="give a CSV file")
        if not first.strip():
            raise LogError("the file is empty, or its first line is", where=str(path))
        # a comma between semicolons or tabs is a decimal one, a space beside any of them is nothing
        self._separator = next((mark for mark in ";\t, " if mark in first.strip()), ",")
        cells = self._cells(first)
        self._header = not all(_NUMBER.fullmatch(self._point(cell)) or not cell for cell in cells)
        self.names = cells if self._header else [str(k) for k in range(len(cells))]
        if self._header and (twice := sorted({c for c in cells if cells.count(c) > 1})):
            raise LogError(f"two columns are named {twice[0]!r}", where=str(path), do="rename one")

    def _cells(self, line: str) -> list[str]:
        return [cell.strip().strip('"') for cell in line.split(self._separator)]

    def _point(self, cell: str) -> str:
        return cell if self._separator == "," else cell.replace(",", ".")

    def load(self, names):
        positions = [self.names.index(name) for name in names]
        # polars wants ascending positions and each once; the header is skipped because we name the columns
        wanted = sorted(set(positions))
        try:
            try:
                frame = self._frame(wanted, {f"column_{k + 1}": pl.Float64 for k in range(len(self.names))})
            except pl.exceptions.NoDataError:
                raise LogError("there is a header and no row below it", where=str(self.path), do="give a log with samples") from None
            except pl.exceptions.PolarsError:
                frame = self._frame(wanted, None)  # as text, to find the cell that is no number
        except (pl.exceptions.PolarsError, OSError) as error:
            raise LogError(
                f"cannot be read as CSV ({str(error).splitlines()[0]})", where=f"{self.path}{self._longest()}", do="correct the row or leave it out"
            ) from None
        if self._truncated() and frame.height:
            warnings.warn(SysidWarning(f"{self.path.name}: the last row is truncated and was dropped"), stacklevel=2)
            frame = frame.head(frame.height - 1)
        out = {}
        for position, column in zip(wanted, list(frame.columns)):
            name, cells = self.names[position], frame.drop_in_place(column)
            values = cells if cells.dtype == pl.Float64 else self._parsed(cells)
            bad = values.is_null()
            if bad.any():
                row = int(bad.arg_max())
                said = "the cell is empty" if cells[row] is None else f"{cells[row]!r} is no number"
                raise LogError(said, where=f"{self.path} line {row + 1 + self._header} column {name!r}", do="correct the row or leave it out")
            out[name] = values.to_numpy()
        return {name: out[name] for name in names}

    def _frame(self, wanted, schema) -> pl.DataFrame:
        return pl.read_csv(
            self.path, has_header=False, skip_rows=int(self._header), separator=self._separator, columns=wanted,
            infer_schema=False, schema_overrides=schema,
        )  # fmt: skip

    def _parsed(self, cells: pl.Series) -> pl.Series:
        cells = cells.str.strip_chars()
        return (cells if self._separator == "," else cells.str.replace(",", ".", literal=True)).cast(pl.Float64, strict=False)

    def _longest(self) -> str:
        """Names the first line with more cells than the first of all."""
        with self.path.open(encoding="utf-8", errors="replace") as file:
            for number, line in enumerate(file, 1):
                if (cells := len(self._cells(line))) > len(self.names):
                    return f" line {number} ({cells} cells, the first line has {len(self.names)})"
        return ""

    def _truncated(self) -> bool:
        """The last row lacks cells, or its last cell is broken off."""
        with self.path.open("rb") as file:
            file.seek(0, 2)
            file.seek(max(0, file.tell() - 1_000_000))
            text = file.read().decode("utf-8", errors="replace")
        lines = [line for line in text.splitlines() if line.strip()]
        cells = self._cells(lines[-1]) if lines else self.names
        return len(cells) < len(self.names) or (not text.endswith(("\n", "\r")) and not _NUMBER.fullmatch(self._point(cells[-1])))
