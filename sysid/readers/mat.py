"""MAT files: which version is it?"""

from .mat5 import Mat5Table
from .mat73 import Mat73Table
from .table import ArrayTable

_HDF5 = b"\x89HDF\r\n\x1a\n"


def open_mat(path) -> ArrayTable:
    """The table of a MAT file, v5 or v7.3."""
    with path.open("rb") as file:
        head = file.read(520)
    return Mat73Table(path) if _HDF5 in head or b"MATLAB 7.3" in head[:128] else Mat5Table(path)


__all__ = ["Mat5Table", "Mat73Table", "open_mat"]
