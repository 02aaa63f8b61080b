"""MAT v7.3: HDF5 with its arrays transposed; structs are groups, cells are references."""

import math

import numpy as np

from ..errors import LogError
from .hdf5 import own_item
from .table import ArrayTable, most_bytes


class Mat73Table(ArrayTable):
    """Variables by name, fields of structs as `a.b`, cells of one sample each as a matrix with a row for each."""

    def __init__(self, path):
        import h5py

        self.path = path
        self._reference = h5py.check_ref_dtype
        self._datasets, shapes = {}, {}
        try:
            self._file = h5py.File(path, "r")
            self._collect("", self._file)
            for name, dataset in self._datasets.items():
                if shape := self._shape(dataset):
                    shapes[name] = shape
        except LogError:
            raise
        except Exception as error:  # h5py raises what it likes on corrupt bytes
            raise self._unreadable("the MAT v7.3 file", error) from None
        super().__init__(path, shapes)

    def _unreadable(self, what: str, error: Exception) -> LogError:
        said = (str(error).splitlines() or [type(error).__name__])[0]
        return LogError(f"{what} cannot be read ({said})", where=str(self.path), do="save it again, with -v7 or -v7.3")

    def _collect(self, prefix, group):
        for name in group:
            if name.startswith("#"):
                continue  # what cells refer to stands under #refs#, an item for each cell
            item = own_item(group, name, str(self.path))
            if hasattr(item, "dtype"):
                self._datasets[prefix + name] = item
            elif item is not None:
                self._collect(f"{prefix}{name}.", item)

    def _shape(self, dataset):
        if not self._reference(dataset.dtype):
            return dataset.shape[::-1] if np.issubdtype(dataset.dtype, np.number) else None
        first = self._file[dataset[()].ravel()[0]] if 0 < dataset.nbytes <= most_bytes(self.path) else None
        # cells of structs or of text have no place in a log; that is no reason to refuse what else is there
        return (dataset.size, first.size) if hasattr(first, "size") else None

    def fetch(self, name):
        dataset = self._datasets[name]
        if dataset.nbytes > most_bytes(self.path):  # HDF5 may promise more than any memory holds, in a few bytes
            raise self._unreadable(f"variable {name!r}", ValueError(f"{dataset.nbytes} bytes in a file of {self.path.stat().st_size}"))
        try:
            values = self._cells(dataset) if self._reference(dataset.dtype) else dataset[()].T
        except Exception as error:  # as above
            raise self._unreadable(f"variable {name!r}", error) from None
        if values is None:
            raise LogError(
                f"the cells of {name!r} differ in size",
                where=str(self.path),
                allowed="one sample of the same size in each cell",
                do="correct data.columns",
            )
        return values

    def _cells(self, dataset) -> np.ndarray | None:
        """A row for each cell; None where they differ in size. A cell is a dataset of its own, opened at HDF5's lowest level for speed."""
        from h5py import h5r, h5s, h5t

        out = np.empty((dataset.size, self._shape(dataset)[1]))
        for row, reference in zip(out, dataset[()].ravel()):
            cell = h5r.dereference(reference, self._file.id)
            if math.prod(cell.shape) != len(row):
                return None
            cell.read(h5s.ALL, h5s.ALL, row.reshape(cell.shape), h5t.NATIVE_DOUBLE)  # HDF5's order of the axes is MATLAB's turned round
        return out
