"""CSV: with or without a header; comma, semicolon, tab or spaces between numbers."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections import Counter

import polars as pl

from .. import units
from ..errors import LogError
from ..warned import warn
from .table import Table

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?(nan|inf|infinity)", re.IGNORECASE)
_QUOTED = re.compile(r'"[^"]*"')
_LINE, _TAIL = 10_000_000, 1_000_000  # bytes of a first line; of an end that is looked at


class CsvTable(Table):
    """Columns by the names in the header; without one they are named 0, 1, 2 … and found by number."""

    def __init__(self, path):
        self.path = path
        with path.open("rb") as file:
            data, second = file.readline(_LINE), file.readline(_LINE)
        try:
            first = data.decode("utf-8-sig").rstrip("\r\n")
        except UnicodeDecodeError:
            wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
            raise LogError("text in UTF-16" if wide else "not text", where=str(path), do="save it as UTF-8" if wide else "give a CSV file") from None
        if "\0" in first or len(data) == _LINE:
            raise LogError("not text" if "\0" in first else f"a first line of more than {_LINE} bytes", where=str(path), do="give a CSV file")
        if not first.strip():
            raise LogError("the file is empty, or its first line is", where=str(path))
        # a comma between semicolons or tabs is a decimal one, a space beside any of them is nothing; inside quotes none separates
        bare = _QUOTED.sub("x", first).strip()
        self._separator = next((mark for mark in ";\t, " if mark in bare), ",")
        cells = self._cells(first)
        self._header = not all(_NUMBER.fullmatch(self._point(cell)) or not cell for cell in cells)
        self.names = cells if self._header else [str(k) for k in range(len(cells))]
        if self._header and (twice := sorted(c for c, count in Counter(cells).items() if count > 1)):
            raise LogError(f"two columns are named {twice[0]!r}", where=str(path), do="rename one")
        # a second line of units, "s,deg,Nm": no number in it, and units for the most part
        below = self._cells(second.decode("utf-8", errors="replace"))[: len(cells)]
        bare = not any(_NUMBER.fullmatch(self._point(cell)) for cell in below)
        self._above = int(self._header)
        if self._header and bare and 2 * sum(map(units.is_unit, below)) > len(cells):
            self._above, self.stated = 2, {n: u.strip("[]()") for n, u in zip(cells, below)}
        # how wide the table is, a reader goes by this line
        named = max((k + 1 for k, cell in enumerate(cells) if cell), default=0)
        if self._above == 1 and second.strip() and len(below) < named:
            raise LogError(f"{len(below)} cells where the first line has {named}", where=f"{path} line 2", do="correct the row, or the first line")
        # columns that no name stands above shift the names, or not: nobody can know
        if any(below := self._cells(second.decode("utf-8", errors="replace"))[len(cells) :]):
            raise LogError(f"{len(cells) + len(below)} cells where the first line has {len(cells)}", where=f"{path} line 2", do="name every column in the first line")

    def _cells(self, line: str) -> list[str]:
        if '"' not in line:
            return [cell.strip() for cell in (line.split() if self._separator == " " else line.split(self._separator))]
        try:
            (cells,) = csv.reader([line.strip("\r\n")], delimiter=self._separator, skipinitialspace=True)
        except (csv.Error, ValueError):
            raise LogError("a quotation mark that does not end", where=str(self.path), do="correct the line") from None
        cells = cells if self._separator != " " else [cell for cell in cells if cell]
        return [cell.strip().strip('"') for cell in cells]

    def _point(self, cell: str) -> str:
        return cell if self._separator == "," else cell.replace(",", ".")

    def load(self, names, empty=()):
        places = {name: k for k, name in enumerate(self.names)}
        positions = [places[name] for name in names]
        # polars wants ascending positions and each once; the header is skipped because we name the columns
        wanted = sorted(set(positions))
        rows, blank, truncated = self._end()
        if self._header and rows == self._above:
            raise LogError("there is a header and no row below it", where=str(self.path), do="give a log with samples")
        try:
            try:
                frame = self._frame(wanted, {f"column_{k + 1}": pl.Float64 for k in wanted})
            except pl.exceptions.PolarsError:
                frame = self._frame(wanted, None)  # as text, to find the cell that is no number
        except (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError) as error:
            said = (str(error).splitlines() or [type(error).__name__])[0]
            raise LogError(f"cannot be read as CSV ({said})", where=f"{self.path}{self._longest()}", do="correct the row or leave it out") from None
        frame = frame.head(max(frame.height - blank, 0))
        if truncated and frame.height:
            warn(f"{self.path.name}: the last row is truncated and was dropped")
            frame = frame.head(frame.height - 1)
        out, columns = {}, frame.get_columns()
        del frame  # a column at a time: the file never stands in memory beside the arrays
        for k, position in enumerate(wanted):
            name, cells = self.names[position], columns[k]
            columns[k] = None
            values = cells if cells.dtype == pl.Float64 else self._parsed(cells)
            bad = values.is_null() & cells.is_not_null() if name in empty else values.is_null()
            if bad.any():
                row = int(bad.arg_max())
                said = "the cell is empty" if cells[row] is None else f"{cells[row][:60]!r} is no number"
                raise LogError(said, where=f"{self.path} line {row + 1 + self._above} column {name!r}", do="correct the row or leave it out")
            out[name] = values.to_numpy()  # what is empty is NaN
        return {name: out[name] for name in names}

    def _frame(self, wanted, schema) -> pl.DataFrame:
        return pl.read_csv(
            self._evenly_spaced() if self._separator == " " else self.path, has_header=False, skip_rows=self._above,
            separator=self._separator, columns=wanted, infer_schema=False, schema_overrides=schema,
        )  # fmt: skip

    def _evenly_spaced(self) -> io.BytesIO:
        """The file with one space between cells, however its columns are aligned."""
        out = io.BytesIO()
        with self.path.open("rb") as file:
            for line in file:
                out.write(b" ".join(line.split()) + b"\n")
        out.seek(0)
        return out

    def _parsed(self, cells: pl.Series) -> pl.Series:
        cells = cells.str.strip_chars()
        return (cells if self._separator == "," else cells.str.replace(",", ".", literal=True)).cast(pl.Float64, strict=False)

    def _longest(self) -> str:
        """Names the first line with more cells than the first of all."""
        with self.path.open(encoding="utf-8", errors="replace") as file:
            for number, line in enumerate(file, 1):
                if line.count(self._separator) >= len(self.names) and (cells := len(self._cells(line))) > len(self.names):
                    return f" line {number} ({cells} cells, the first line has {len(self.names)})"
        return ""

    def _end(self) -> tuple[int | None, int, bool]:
        """How many lines there are up to the last that is not blank, None where these are many; how many blank ones follow; and
        whether that last row lacks cells, or its last cell is broken off."""
        with self.path.open("rb") as file:
            size, look = file.seek(0, 2), _TAIL
            while True:
                file.seek(max(0, size - look))
                data = file.read()
                if look >= size or b"\n" in data.rstrip():
                    break
                look *= 4
        lines = data.decode("utf-8", errors="replace").split("\n")
        last = next((k for k in range(len(lines) - 1, -1, -1) if lines[k].strip()), -1)
        if last < 0:
            return 0, 0, False
        blank = len(lines) - 1 - last - (lines[-1] == "")  # what follows the last line feed is no line
        cells = self._cells(lines[last])
        broken = last == len(lines) - 1 and not _NUMBER.fullmatch(self._point(cells[-1])) and not lines[last].endswith("\r")
        return last + 1 if look >= size else None, max(blank, 0), len(cells) < len(self.names) or broken
