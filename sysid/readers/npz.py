"""NPZ: NumPy archives of plain arrays. Pickled objects are refused, as loading them would run code."""

import zipfile
import zlib

import numpy as np

from ..errors import LogError
from .table import ArrayTable


class NpzTable(ArrayTable):
    """Variables by name, matrices column by column."""

    def __init__(self, path):
        try:
            self._archive = np.load(path, allow_pickle=False)
            names = self._archive.files
        except (OSError, ValueError, zipfile.BadZipFile, AttributeError) as error:
            raise LogError(f"not a readable NPZ file ({_said(error)})", where=str(path)) from None
        self.path = path
        self._arrays = {name: self.fetch(name) for name in names}
        super().__init__(path, {name: array.shape for name, array in self._arrays.items()})

    def fetch(self, name):
        if name in getattr(self, "_arrays", {}):
            return self._arrays[name]
        try:
            return self._archive[name]
        except (OSError, ValueError, zipfile.BadZipFile, zlib.error, EOFError) as error:
            raise LogError(f"variable {name!r} cannot be read ({_said(error)})", where=str(self.path), allowed="plain arrays, not pickled objects") from None


def _said(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
