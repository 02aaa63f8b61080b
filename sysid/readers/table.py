"""What a reader gives: named columns, loaded when asked for."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from functools import cached_property
from pathlib import Path
from types import MappingProxyType

import numpy as np

from ..errors import LogError

# Numbers with noise never shrink so far; a file that was made to fill a disk or a memory does.
_MOST, _ANY = 300, 2**28  # times its size; bytes that any may have


def most_bytes(path: Path) -> int:
    """How many bytes a file may unpack to, or an array in it may have."""
    return max(_ANY, _MOST * path.stat().st_size)


class Table(ABC):
    """Named columns of a file. Matrices (n, k) go by their name, and column by column as `name[0]` …

    usual: what the format itself calls its signals, {"time", "position", "velocity", "torque" or "command": a column, or a
        pattern with {joint}}; it stands in for the defaults of an experiment. clock: the unit of that time where the format
        says it. stated: {column: the unit that a row below the names says}. rate: samples a second, where a file without a
        clock says it. rows: how many it has, where `between(first, last)` gives a table of some of them without reading the
        others.
    """

    path: Path
    names: list[str]
    usual: Mapping[str, str] = MappingProxyType({})
    clock: str | None = None
    rate: float | None = None
    stated: Mapping[str, str] = MappingProxyType({})
    rows: int | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that the table was read from."""
        return (self.path,)

    def titled(self, name: str) -> str:
        """A column's name with the unit that a row below the names states, as a header does: "q [deg]"."""
        return f"{name} [{self.stated[name]}]" if self.stated.get(name) else name

    @abstractmethod
    def load(self, names: list[str], empty: Collection[str] = ()) -> dict[str, np.ndarray]:
        """The named columns as arrays of floats or whole numbers: (n,), or (n, k) for the name of a matrix.

        Args:
            empty: columns of which a cell may be empty, which is NaN; of any other that is refused.
        """

    def width(self, name: str) -> int:
        """How many columns stand behind a name: more than one for a matrix."""
        return 1

    def has(self, name) -> bool:
        """Whether there is a column of that name."""
        return name in self._named

    @cached_property
    def _named(self) -> frozenset:
        return frozenset(self.names)

    @cached_property
    def _single(self) -> list[str]:
        return [name for name in self.names if self.width(name) == 1]

    def resolve(self, column: str | int) -> str:
        """The name of a column given by its name, or by its number from 0 (the columns of a matrix count one by one).

        Raises:
            LogError: no such column.
        """
        if isinstance(column, int):
            single = self._single
            if not 0 <= column < len(single):
                raise LogError(f"there is no column {column}", where=str(self.path), allowed=f"0 to {len(single) - 1}", do="correct data.columns")
            return single[column]
        if not self.has(column):
            raise LogError(f"there is no column {column!r}", where=str(self.path), allowed=self.some_names(), do="correct data.columns")
        return column

    def some_names(self) -> str:
        """The names to show in a message, the first twenty."""
        return ", ".join(self.names[:20]) + (" …" if len(self.names) > 20 else "") or "nothing: the file holds no column of numbers"


class ArrayTable(Table):
    """A table of arrays that are in memory, or come from `fetch` one at a time."""

    def __init__(self, path: Path, shapes: dict[str, tuple[int, ...]]):
        self.path = path
        self._widths = {}
        self.names = []
        for name, shape in shapes.items():
            if len(shape) > 2 or not shape:
                continue
            width = self.width_of(shape)
            self._widths[name] = width
            self.names.append(name)
            if width > 1:
                self.names += [f"{name}[{k}]" for k in range(width)]

    @abstractmethod
    def fetch(self, name: str) -> np.ndarray:
        """The array behind a variable's name."""

    def width(self, name):
        return self._widths.get(name, 1)

    def width_of(self, shape: tuple[int, ...]) -> int:
        """How many columns an array of a shape is; samples run along the longer side."""
        return 1 if len(shape) == 1 or 1 in shape else min(shape)

    def upright(self, array: np.ndarray) -> np.ndarray:
        """An array with a row for each sample: (n,) or (n, k)."""
        if array.ndim == 2 and 1 in array.shape:
            return array.ravel()
        return array.T if array.ndim == 2 and array.shape[0] < array.shape[1] else array

    def load(self, names, empty=()):
        out, held = {}, {}
        for name in names:
            variable, _, index = name.partition("[") if name not in self._widths else (name, "", "")
            if variable not in held:
                held[variable] = self._oriented(variable)
            out[name] = held[variable][:, int(index[:-1])] if index else held[variable]
        return out

    def _oriented(self, name) -> np.ndarray:
        array = np.asarray(self.fetch(name))
        if array.dtype.kind not in "biuf":
            raise LogError(f"variable {name!r} holds {array.dtype}", where=str(self.path), allowed="real numbers")
        # whole numbers stay whole: a clock in ns since 1970 has more digits than a float
        array = array if array.dtype.kind in "iu" else array.astype(float, copy=False)
        return self.upright(array)


def stacked(cells) -> np.ndarray | None:
    """Cells of one sample each as a matrix (n, k); None where they hold anything else."""
    try:
        arrays = [np.asarray(cell, dtype=float).ravel(order="F") for cell in cells]
    except (TypeError, ValueError):
        return None
    if not arrays or len({array.size for array in arrays}) != 1:
        return None
    return np.stack(arrays)
