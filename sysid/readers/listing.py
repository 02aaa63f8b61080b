"""Which logs a name means: a file, a bag or data set that is a folder, every log of a folder, what
a pattern matches."""

from __future__ import annotations

import re
from glob import glob, has_magic
from pathlib import Path

from . import lerobot

TABLES = (".csv", ".txt", ".tsv", ".parquet", ".pq", ".npz", ".mat", ".h5", ".hdf5")
BAGS = (".mcap", ".db3", ".bag")
PACKED = (".gz", ".bz2", ".xz")


def listed(name: str, folder: Path) -> list[str]:
    """The logs that a name in an experiment means, in the order in which people count (run_2 before
    run_10).

    A name that means none stands for itself: it is said where it is read.

    Args:
        folder: what a relative name is relative to; the names given back are relative to it too.
    """
    path = folder / name
    if path.exists() or path.is_symlink():
        if not path.is_dir() or is_log_folder(path):
            return [name]
        found = [entry.name for entry in path.iterdir() if not entry.name.startswith(".")]
        found = [str(Path(name) / entry) for entry in found if _is_log(path / entry)]
    elif has_magic(name):
        found = [
            entry
            for entry in glob(name, root_dir=folder, recursive=True)
            if _is_log(folder / entry)
        ]
    else:
        found = []
    return sorted(found, key=_counted) or [name]


def is_log_folder(path: Path) -> bool:
    """Whether a folder is one log: a ROS 2 bag, or a LeRobot data set."""
    return path.is_dir() and ((path / "metadata.yaml").is_file() or lerobot.is_dataset(path))


def ending(path: Path) -> str:
    """The ending that says a file's format, below the one that says how it is packed."""
    kind = path.suffix.lower()
    return Path(path.stem).suffix.lower() if kind in PACKED else kind


def _is_log(path: Path) -> bool:
    return is_log_folder(path) or (path.is_file() and ending(path) in (*TABLES, *BAGS))


def _counted(name: str) -> list:
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)]
