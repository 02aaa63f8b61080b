"""MAT files, v5 (SciPy) and v7.3 (HDF5): arrays, structs as `a.b`, and cells that hold one sample each."""

import numpy as np

from ..errors import LogError
from .table import ArrayTable

_HDF5 = b"\x89HDF\r\n\x1a\n"


def open_mat(path) -> ArrayTable:
    """The table of a MAT file of either version."""
    with path.open("rb") as file:
        head = file.read(520)
    return Mat73Table(path) if _HDF5 in head or b"MATLAB 7.3" in head[:128] else Mat5Table(path)


class Mat5Table(ArrayTable):
    """MAT v4 and v5."""

    def __init__(self, path):
        from scipy.io import loadmat
        from scipy.io.matlab import MatReadError

        try:
            tree = loadmat(path, simplify_cells=True)
        except (MatReadError, ValueError, OSError, NotImplementedError, TypeError, IndexError, KeyError, EOFError, OverflowError, MemoryError) as error:
            raise LogError(f"not a readable MAT file ({(str(error).splitlines() or [type(error).__name__])[0]})", where=str(path)) from None
        except Exception as error:  # zlib and the reader's own C code raise what they like on corrupt bytes
            raise LogError(f"the MAT file is corrupt ({type(error).__name__})", where=str(path)) from None
        self._arrays = {}
        self._collect("", {key: value for key, value in tree.items() if not key.startswith("__")})
        super().__init__(path, {name: array.shape for name, array in self._arrays.items()})

    def _collect(self, prefix, tree):
        for key, value in tree.items():
            name = f"{prefix}{key}"
            if isinstance(value, dict):
                self._collect(f"{name}.", value)
                continue
            array = np.asarray(value) if not isinstance(value, list) else _cells(value)
            if array is not None and array.dtype == object:
                array = _cells(array.ravel())
            if array is not None and np.issubdtype(array.dtype, np.number) and not np.iscomplexobj(array):
                self._arrays[name] = array

    def fetch(self, name):
        return self._arrays[name]


class Mat73Table(ArrayTable):
    """MAT v7.3, which is HDF5 with its arrays transposed."""

    def __init__(self, path):
        import h5py

        try:
            self._file = h5py.File(path, "r")
            self._datasets = {}
            self._file.visititems(self._collect)
            shapes = {name: self._shape(dataset) for name, dataset in self._datasets.items()}
        except (OSError, KeyError, ValueError, RuntimeError) as error:
            raise LogError(f"not a readable MAT v7.3 file ({str(error).splitlines()[0]})", where=str(path)) from None
        super().__init__(path, {name: shape for name, shape in shapes.items() if shape})

    def _collect(self, name, item):
        import h5py

        if isinstance(item, h5py.Dataset) and not name.startswith("#"):
            self._datasets[name.replace("/", ".")] = item

    def _is_cell(self, dataset) -> bool:
        import h5py

        return h5py.check_ref_dtype(dataset.dtype) is not None

    def _shape(self, dataset):
        if self._is_cell(dataset):
            if not dataset.size:
                return None
            first = self._file[dataset[()].ravel()[0]]
            return (dataset.size, first.size)
        return dataset.shape[::-1] if np.issubdtype(dataset.dtype, np.number) else None

    def fetch(self, name):
        dataset = self._datasets[name]
        try:
            if not self._is_cell(dataset):
                return dataset[()].T
            stacked = _cells([self._file[reference][()].T.ravel(order="F") for reference in dataset[()].ravel()])
        except (OSError, KeyError, ValueError, RuntimeError) as error:
            raise LogError(f"variable {name!r} cannot be read ({str(error).splitlines()[0]})", where=str(self.path)) from None
        if stacked is None:
            raise LogError(f"the cells of {name!r} differ in size", where=str(self.path), allowed="one sample of the same size a cell")
        return stacked


def _cells(cells) -> np.ndarray | None:
    """Cells of one sample each as (n, k); None where they hold anything else."""
    try:
        arrays = [np.asarray(cell, dtype=float).ravel(order="F") for cell in cells]
    except (TypeError, ValueError):
        return None
    if not arrays or len({array.size for array in arrays}) != 1:
        return None
    return np.stack(arrays)
