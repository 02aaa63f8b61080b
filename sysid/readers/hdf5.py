"""HDF5 as robot learning writes it: datasets (samples, width) in groups. What points out of the
file is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import LogError
from .table import ArrayTable, most_bytes

_DEEPEST = 50

_STATE, _STAMP = "observation/robot_state/", "observation/timestamp/"
#: clocks of DROID and their units, the robot's own first
_CLOCKS = {
    _STAMP + "robot_state/robot_timestamp": "ns",
    _STAMP + "robot_state/read_start": "ms",
    _STAMP + "control/step_start": "ms",
}
#: attributes of a file that say how often it was written: samples a second, and seconds a sample
_RATES = ("fps", "hz", "rate", "frequency", "freq", "sample_rate", "control_frequency")
_PERIODS = ("dt", "period", "timestep", "control_dt")
#: what kinds of file call their signals, the first of each that is there; ALOHA and DROID
_USUAL = {
    "command": ("action", "action/joint_position"),
    "time": tuple(_CLOCKS),
    "position": ("observations/qpos", _STATE + "joint_positions"),
    "velocity": ("observations/qvel", _STATE + "joint_velocities"),
    "torque": (
        "observations/effort",
        _STATE + "motor_torques_measured",
        _STATE + "joint_torques_computed",
    ),
}


class Hdf5Table(ArrayTable):
    """Datasets by their path, `observations/qpos`, with or without a slash before it; rows are
    samples.

    A pair of datasets `x_seconds` and `x_nanos` is also one column `x` in whole ns.
    """

    def __init__(self, path: Path):
        import h5py

        self.path = path
        self._datasets: dict[str, object] = {}
        try:
            self._file = h5py.File(path, "r")
            for name, dataset in contained(self._file, str(path)):
                if np.issubdtype(dataset.dtype, np.number) and 0 < dataset.size and dataset.nbytes <= most_bytes(path):
                    self._datasets[name] = dataset
            self.rate = _rate(dict(self._file.attrs))
        except LogError:
            raise
        except Exception as error:  # h5py raises what it likes on corrupt bytes
            raise self._unreadable("the HDF5 file", error) from None
        shapes = {name: dataset.shape for name, dataset in self._datasets.items()}
        self._pairs = [n.removesuffix("_seconds") for n in shapes if n.endswith("_seconds")]
        self._pairs = [name for name in self._pairs if name + "_nanos" in shapes]
        super().__init__(path, shapes | {name: shapes[name + "_seconds"] for name in self._pairs})
        there = {
            key: [name for name in names if name in self.names] for key, names in _USUAL.items()
        }
        self.usual = {key: names[0] for key, names in there.items() if names}
        self.clock = _CLOCKS.get(self.usual.get("time"))

    def _unreadable(self, what: str, error: Exception) -> LogError:
        said = (str(error).splitlines() or [type(error).__name__])[0]
        return LogError(
            f"{what} cannot be read ({said})", where=str(self.path), do="write it again"
        )

    def width_of(self, shape):
        return 1 if len(shape) == 1 else shape[1]

    def upright(self, array):
        return array.ravel() if array.ndim == 2 and array.shape[1] == 1 else array

    def resolve(self, column):
        return super().resolve(column.lstrip("/") if isinstance(column, str) else column)

    def fetch(self, name):
        try:
            if name in self._pairs:
                seconds, nanos = (self._datasets[name + end][()] for end in ("_seconds", "_nanos"))
                return seconds.astype(np.int64) * 1_000_000_000 + nanos.astype(np.int64)
            return self._datasets[name][()]
        except Exception as error:  # as above
            raise self._unreadable(f"dataset {name!r}", error) from None


def _rate(attributes: dict) -> float | None:
    """Samples a second, as the attributes of a file say."""
    said = {str(name).lower(): value for name, value in attributes.items() if np.size(value) == 1}
    said = {n: float(v) for n, v in said.items() if np.asarray(v).dtype.kind in "iuf" and v > 0}
    rates = [said[name] for name in _RATES if name in said]
    rates += [1.0 / said[name] for name in _PERIODS if name in said]
    return rates[0] if rates and np.isfinite(rates[0]) else None


def contained(group, where: str, prefix: str = "", seen: set | None = None, depth: int = 0):
    """Path and dataset of everything that stands in an HDF5 file itself, each group once.

    Raises:
        LogError: see `own_item`; groups that are too deep.
    """
    import h5py

    seen = set() if seen is None else seen
    address = h5py.h5o.get_info(group.id).addr
    if address in seen:  # a group may be linked into itself
        return
    seen.add(address)
    if depth > _DEEPEST:
        raise LogError(f"groups more than {_DEEPEST} deep", where=where, do="write the log flat")
    for name in group:
        item = own_item(group, name, where)
        if isinstance(item, h5py.Dataset):
            yield prefix + name, item
        elif isinstance(item, h5py.Group):
            yield from contained(item, where, f"{prefix}{name}/", seen, depth + 1)


def own_item(group, name: str, where: str):
    """What stands under a name of a group; None for a soft link, as what it names stands under its
    own name.

    Raises:
        LogError: it is a link, a virtual dataset or a dataset's storage in another file: opening a
        log must open no
            file that the user did not name.
    """
    import h5py

    link = group.get(name, getlink=True)
    if isinstance(link, h5py.SoftLink):
        return None
    what = "an external link" if isinstance(link, h5py.ExternalLink) else None
    item = None if what else group[name]
    if isinstance(item, h5py.Dataset):
        what = (
            "a virtual dataset"
            if item.is_virtual
            else "kept in an external file"
            if item.external
            else None
        )
    if what:
        raise LogError(
            f"{name!r} is {what}, which would open another file", where=where,
            do="copy what it names into this file (h5repack, or h5py's Group.copy)",
        )  # fmt: skip
    return item
