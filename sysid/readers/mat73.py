"""MAT v7.3: HDF5 with its arrays transposed; structs are groups, cells are references."""

import numpy as np

from ..errors import LogError
from .table import ArrayTable, stacked


class Mat73Table(ArrayTable):
    """Variables by name, fields of structs as `a.b`, cells of one sample each as a matrix with a row for each."""

    def __init__(self, path):
        import h5py

        self.path = path
        self._reference = h5py.check_ref_dtype
        self._datasets, shapes = {}, {}
        try:
            self._file = h5py.File(path, "r")
            self._file.visititems(self._collect)
            for name, dataset in self._datasets.items():
                if shape := self._shape(dataset):
                    shapes[name] = shape
        except Exception as error:  # h5py raises what it likes on corrupt bytes
            raise self._unreadable("the MAT v7.3 file", error) from None
        super().__init__(path, shapes)

    def _unreadable(self, what: str, error: Exception) -> LogError:
        said = (str(error).splitlines() or [type(error).__name__])[0]
        return LogError(f"{what} cannot be read ({said})", where=str(self.path), do="save it again, with -v7 or -v7.3")

    def _collect(self, name, item):
        # what cells refer to stands under #refs#
        if hasattr(item, "dtype") and not name.startswith("#"):
            self._datasets[name.replace("/", ".")] = item

    def _shape(self, dataset):
        if not self._reference(dataset.dtype):
            return dataset.shape[::-1] if np.issubdtype(dataset.dtype, np.number) else None
        first = self._file[dataset[()].ravel()[0]] if dataset.size else None
        # cells of structs or of text have no place in a log; that is no reason to refuse what else is there
        return (dataset.size, first.size) if hasattr(first, "size") else None

    def fetch(self, name):
        dataset = self._datasets[name]
        try:
            if not self._reference(dataset.dtype):
                return dataset[()].T
            cells = stacked([self._file[reference][()].T for reference in dataset[()].ravel()])
        except Exception as error:  # as above
            raise self._unreadable(f"variable {name!r}", error) from None
        if cells is None:
            raise LogError(f"the cells of {name!r} differ in size", where=str(self.path), allowed="one sample of the same size in each cell")
        return cells
