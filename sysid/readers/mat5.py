"""MAT v5: a header of 128 bytes, then elements, each a tag (type, size) and its content; a matrix holds elements.

SciPy's reader trusts type numbers and sizes, and corrupt ones end the process; here each is checked first.

Source: MathWorks, MAT-File Format, chapter 1 (level 5).
"""

import math
import struct
import zlib

import numpy as np

from ..errors import LogError
from .table import ArrayTable, most_bytes, stacked

_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT = 1, 2
_NUMERIC = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_COMPLEX = 0x800


class Mat5Table(ArrayTable):
    """Variables by name, fields of structs as `a.b`, cells of one sample each as a matrix with a row for each."""

    def __init__(self, path):
        self._arrays = {}
        try:
            for name, value in _variables(path.read_bytes(), most_bytes(path)):
                self._collect(name, value)
        except (ValueError, KeyError, IndexError, struct.error, zlib.error, RecursionError, OSError, MemoryError) as error:
            raise LogError(
                f"the MAT file is corrupt ({str(error) or type(error).__name__})", where=str(path), do="save it again, with -v7 or -v7.3"
            ) from None
        super().__init__(path, {name: array.shape for name, array in self._arrays.items()})

    def _collect(self, name, value):
        if isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            # an array of structs: one sample in each
            value = value[0] if len(value) == 1 else {key: [item[key] for item in value] for key in value[0]}
        if isinstance(value, dict):
            for key, inner in value.items():
                self._collect(f"{name}.{key}", inner)
            return
        array = stacked(value) if isinstance(value, list) else value
        if array is not None:
            self._arrays[name] = np.squeeze(array)

    def fetch(self, name):
        return self._arrays[name]


def _variables(data: bytes, most: int):
    """Name and value of every variable: an array, a list of cells, a list of structs (dicts), None for what else there is."""
    if len(data) < 128 or data[126:128] not in (b"IM", b"MI"):
        raise ValueError("it has no header of MAT v5")
    order = "<" if data[126:128] == b"IM" else ">"
    view, at = memoryview(data), 128
    while at < len(view):
        kind, content, at = _element(view, at, order)
        if kind == _COMPRESSED:
            unpacker = zlib.decompressobj()
            unpacked = unpacker.decompress(content, most)
            if unpacker.unconsumed_tail:
                raise ValueError(f"a variable unpacks to more than {most} bytes")
            if not unpacker.eof:
                raise ValueError("a variable is cut off")
            kind, content, _ = _element(memoryview(unpacked), 0, order)
        if kind != _MATRIX:
            raise ValueError(f"an element of type {kind} where a variable should be")
        name, value = _matrix(content, order)
        if name and not name.startswith("__"):
            yield name, value


def _element(view, at: int, order: str):
    """Type and content of the element at a position, and where the next one starts."""
    kind, size = struct.unpack_from(order + "II", view, at)
    if kind >> 16:  # up to four bytes stand in the tag itself
        kind, size, start, after = kind & 0xFFFF, kind >> 16, at + 4, at + 8
        if size > 4:
            raise ValueError(f"a short element of {size} bytes")
    else:
        start = at + 8
        after = start + size + (-size % 8 if kind != _COMPRESSED else 0)
    if start + size > len(view):
        raise ValueError(f"an element of {size} bytes where {len(view) - start} are left")
    return kind, view[start : start + size], after


def _array(view, at: int, order: str):
    kind, content, after = _element(view, at, order)
    if kind not in _NUMBERS:
        raise ValueError(f"numbers of the unknown type {kind}")
    return np.frombuffer(content, order + _NUMBERS[kind]), after


def _matrix(view, order: str):
    """Name and value of a matrix."""
    if not len(view):
        return "", None
    flags, at = _array(view, 0, order)
    shape, at = _array(view, at, order)
    letters, at = _array(view, at, order)
    name, kind, shape = letters.tobytes().decode("latin-1"), int(flags[0]) & 0xFF, tuple(shape.tolist())
    if min(shape, default=-1) < 0:
        raise ValueError(f"a variable of shape {shape}")
    if kind in _NUMERIC and not int(flags[0]) & _COMPLEX:
        values, _ = _array(view, at, order)
        if values.size != math.prod(shape):
            raise ValueError(f"{values.size} numbers for a variable of shape {shape}")
        return name, values.astype(_NUMERIC[kind], copy=False).reshape(shape, order="F")
    if kind not in (_CELL, _STRUCT):
        return name, None
    fields = [None]
    if kind == _STRUCT:
        width, at = _array(view, at, order)
        letters, at = _array(view, at, order)
        text, width = letters.tobytes(), int(width[0])
        fields = [text[k : k + width].split(b"\0")[0].decode("latin-1") for k in range(0, len(text), width)]
    if math.prod(shape) * len(fields) * 8 > len(view):
        raise ValueError(f"a variable of shape {shape} in {len(view)} bytes")
    items = []
    for _ in range(math.prod(shape)):
        item = {}
        for field in fields:
            inner, content, at = _element(view, at, order)
            if inner != _MATRIX:
                raise ValueError(f"an element of type {inner} in a cell or struct")
            item[field] = _matrix(content, order)[1]
        items.append(item if kind == _STRUCT else item[None])
    return name, items
