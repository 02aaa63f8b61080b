"""Compressed logs, `run.csv.gz`: unpacked into a temporary file, which the reader of the inner
ending opens."""

from __future__ import annotations

import bz2
import gzip
import lzma
import zlib
from pathlib import Path

from ..errors import LogError
from ..unfinished import temporary_folder
from .table import Table, most_bytes

OPENERS = {".gz": gzip.open, ".bz2": bz2.open, ".xz": lzma.open}
_CHUNK = 2**20


class PackedTable(Table):
    """The table inside a compressed file; what it says of itself names the compressed file."""

    def __init__(self, path: Path, open_inner):
        self.path = path
        self._unpacked = temporary_folder(self) / path.stem
        self._unpack()
        self._table = self._told(lambda: open_inner(self._unpacked))
        self.names, self.usual, self.clock = self._table.names, self._table.usual, self._table.clock
        self.rate = self._table.rate

    def _unpack(self) -> None:
        most = most_bytes(self.path)
        try:
            with (
                OPENERS[self.path.suffix.lower()](self.path) as packed,
                self._unpacked.open("wb") as file,
            ):
                while chunk := packed.read(_CHUNK):
                    if file.tell() > most:
                        raise LogError(
                            f"it unpacks to more than {most} bytes", where=str(self.path),
                            do="unpack it yourself if it is meant so",
                        )  # fmt: skip
                    file.write(chunk)
        except (OSError, EOFError, lzma.LZMAError, zlib.error) as error:
            raise LogError(
                f"cannot be unpacked ({error})", where=str(self.path), do="pack it again"
            ) from None

    def _told(self, work):
        try:
            return work()
        except LogError as error:
            raise LogError(str(error).replace(str(self._unpacked), str(self.path))) from None

    def width(self, name):
        return self._table.width(name)

    def resolve(self, column):
        return self._told(lambda: self._table.resolve(column))

    def load(self, names, empty=()):
        return self._told(lambda: self._table.load(names, empty))
