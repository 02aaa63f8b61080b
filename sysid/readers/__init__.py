"""One reader for each file format: file -> Table of named columns. Nothing is executed that a file holds."""

from pathlib import Path

from ..errors import LogError
from .table import Table


def open_table(path: Path) -> Table:
    """The table in a file, by its ending.

    Raises:
        LogError: the file is not there, of another format, or corrupt.
    """
    if not path.is_file():
        raise LogError("there is no such file", where=str(path), do="check data.train and data.test")
    kind = path.suffix.lower()
    if kind in (".csv", ".txt", ".tsv"):
        from .csv import CsvTable as reader
    elif kind in (".parquet", ".pq"):
        from .parquet import ParquetTable as reader
    elif kind == ".npz":
        from .npz import NpzTable as reader
    elif kind == ".mat":
        from .mat import open_mat as reader
    else:
        raise LogError(f"unknown format {kind or 'without an ending'}", where=str(path), allowed=".csv, .parquet, .npz, .mat")
    return reader(path)
