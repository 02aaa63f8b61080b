"""LeRobot data sets, v2 and v3: Parquet files with list columns, and the names of their elements in
meta/info.json."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from .. import bounded
from ..errors import LogError
from .table import Table

_LARGEST_INFO = 10_000_000  # bytes
#: what LeRobot calls a robot's signals
_USUAL = {
    "position": "observation.state",
    "velocity": "observation.velocity",
    "torque": "observation.effort",
    "command": "action",
}


def is_dataset(path: Path) -> bool:
    """Whether a folder is a LeRobot data set."""
    return (path / "meta" / "info.json").is_file() and (path / "data").is_dir()


def usual(names: list[str], elements: dict[str, list[str]]) -> dict[str, str]:
    """What a table with these columns says of time, position, velocity, torque and commanded position; {} where it is
    not LeRobot's.

    Args:
        elements: the names of a column's elements, where they are known.
    """
    if "observation.state" not in names:
        return {}
    out = {"time": "timestamp"} if "timestamp" in names else {}
    for key, name in _USUAL.items():
        if name in names:
            out[key] = f"{name}.{{joint}}" if name in elements else name
    return out


def element_names(path: Path) -> dict[str, list[str]]:
    """The names of each column's elements, from the meta/info.json of the data set that a path is
    or lies in.

    They are written as a list or as one under some word; `.pos`, which LeRobot adds to joints, is
    taken off.
    """
    folder = next((p for p in [path, *path.parents][:5] if is_dataset(p)), None)
    if folder is None:
        return {}
    info = folder / "meta" / "info.json"
    try:
        if info.stat().st_size > _LARGEST_INFO:
            raise ValueError(f"{info.stat().st_size} bytes")
        features = json.loads(bounded.read_text(info))["features"]
        said = {name: _listed(feature.get("names")) for name, feature in features.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise LogError(
            f"cannot be read ({type(error).__name__}: {str(error)[:80]})",
            where=str(info), do="restore the data set's meta/info.json",
        ) from None  # fmt: skip
    return {name: names for name, names in said.items() if names}


def _listed(names) -> list[str]:
    if isinstance(names, dict) and len(names) == 1:
        (names,) = names.values()
    if isinstance(names, list) and len(names) == 1 and isinstance(names[0], list):
        (names,) = names
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        return []
    own = [name.removesuffix(".pos") for name in names]
    return own if len(set(own)) == len(own) else []


class LeRobotTable(Table):
    """A whole data set as one table: the rows of its Parquet files, in the order of their names."""

    clock = "s"

    def __init__(self, path: Path):
        from .parquet import ParquetTable

        self.path = path
        parts = sorted((path / "data").rglob("*.parquet"))
        if not parts:
            raise LogError("the data set has no Parquet file", where=str(path / "data"))
        self._parts = [ParquetTable(part) for part in parts]
        self.names, self.usual = self._parts[0].names, self._parts[0].usual
        for part in self._parts[1:]:
            if part.names != self.names:
                raise LogError(
                    "its columns are not those of the first file", where=str(part.path),
                    do="name the files one by one in data.train and data.test",
                )  # fmt: skip

    @property
    def files(self) -> tuple[Path, ...]:
        return tuple(part.path for part in self._parts)

    def width(self, name):
        return self._parts[0].width(name)

    def load(self, names, empty=()):
        loaded = [part.load(names, empty) for part in self._parts]
        return {name: np.concatenate([part[name] for part in loaded]) for name in names}
