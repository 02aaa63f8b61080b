"""One reader for each file format: file -> Table of named columns. Nothing is executed that a file holds."""

from glob import has_magic
from pathlib import Path

from ..errors import LogError, meant
from . import lerobot, listing
from .listing import is_log_folder, listed
from .table import Table


def open_table(path: Path, topic: str | None = None) -> Table:
    """The table in a file, by its ending; in a folder that is a ROS 2 bag or a LeRobot data set.

    Args:
        topic: of a bag, where several have joint states.

    Raises:
        LogError: the file is not there, of another format, or corrupt.
    """
    where, kind = str(path), listing.ending(path)
    is_bag = kind in listing.BAGS or (path / "metadata.yaml").is_file()
    if topic is not None and not is_bag:
        raise LogError("a topic is named, and this is no ROS bag", where=where, do="remove topic")
    if path.is_dir():
        return _open_folder(path, topic)
    if not path.is_file():
        what = "no file matches" if has_magic(path.name) else "there is no such file"
        what = "a pipe or a device, no plain file" if path.exists() else what
        beside = [one.name for one in path.parent.iterdir()] if path.parent.is_dir() else []
        do = ": ".join(filter(None, ("check data.train and data.test", meant(path.name, beside, ""))))
        raise LogError(what, where=where, do=do)
    if path.suffix.lower() in listing.PACKED and kind:
        from .packed import PackedTable

        return PackedTable(path, lambda inner: open_table(inner, topic))
    if kind in (".csv", ".txt", ".tsv"):
        from .csv import CsvTable as reader
    elif kind in (".parquet", ".pq"):
        from .parquet import ParquetTable as reader
    elif kind == ".npz":
        from .npz import NpzTable as reader
    elif kind == ".mat":
        from .mat import open_mat as reader
    elif kind in (".h5", ".hdf5"):
        from .hdf5 import Hdf5Table as reader
    elif kind in listing.BAGS:
        from .bag import BagTable

        return BagTable(path, topic)
    else:
        raise LogError(
            f"unknown format {kind or 'without an ending'}", where=where,
            allowed=".csv, .parquet, .npz, .mat, .h5, .mcap, .db3, .bag, and each packed as .gz, .bz2 or .xz",
        )  # fmt: skip
    return reader(path)


def _open_folder(path: Path, topic: str | None) -> Table:
    if (path / "metadata.yaml").is_file():
        from .bag import BagTable

        return BagTable(path, topic)
    if lerobot.is_dataset(path):
        return lerobot.LeRobotTable(path)
    raise LogError(
        "a folder without logs", where=str(path),
        allowed="a folder of logs, a ROS 2 bag (metadata.yaml), a LeRobot data set (meta/info.json)",
        do="check data.train and data.test",
    )  # fmt: skip


__all__ = ["Table", "is_log_folder", "listed", "open_table"]
