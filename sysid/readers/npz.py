"""NPZ: NumPy archives of plain arrays. Pickled objects are refused, as loading them would run code."""

import zipfile

import numpy as np

from ..errors import LogError
from .table import ArrayTable, most_bytes


class NpzTable(ArrayTable):
    """Variables by name, matrices column by column."""

    def __init__(self, path):
        if not zipfile.is_zipfile(path):
            raise LogError("not an NPZ file", where=str(path), do="save it again with numpy.savez")
        try:
            # given an open file, NumPy leaves the closing to us also where it fails
            with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
                if sum(entry.file_size for entry in archive.zip.infolist()) > most_bytes(path):
                    raise ValueError(f"it unpacks to more than {most_bytes(path)} bytes")
                held = {name: archive[name] for name in archive.files}
            # what is no array stands in it as its bytes
            self._arrays = {name: array for name, array in held.items() if isinstance(array, np.ndarray)}
        except Exception as error:  # zipfile, zlib and NumPy's header parser raise what they like on corrupt bytes
            said = (str(error).splitlines() or [type(error).__name__])[0]
            raise LogError(
                f"not a readable NPZ file ({said})", where=str(path), allowed="plain arrays, not pickled objects", do="save it again with numpy.savez"
            ) from None
        super().__init__(path, {name: array.shape for name, array in self._arrays.items()})

    def fetch(self, name):
        return self._arrays[name]
