"""What a public dataset offers: files with checksums, and a table in SI units' own columns."""

import hashlib
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..errors import LogError
from ..readers.table import Table


def data_folder() -> Path:
    """Where public logs are kept: SYSID_DATA_DIR, else the user's cache folder."""
    if folder := os.environ.get("SYSID_DATA_DIR"):
        return Path(folder)
    import pooch

    return Path(pooch.os_cache("sysid"))


@dataclass(frozen=True)
class Dataset:
    """A public dataset.

    files: {file name: (path at the source, SHA-256)}. logs: {name in experiments: its files, the main one first}.
    opener: main file -> Table with the columns t, q_{joint}, tau_{joint} and whatever else was logged.
    """

    name: str
    title: str
    citation: str
    licence: str
    source: str
    files: dict[str, tuple[str, str]]
    logs: dict[str, tuple[str, ...]]
    opener: Callable[[Path], Table]

    def log(self, name: str) -> "DatasetLog":
        """The log (or other file) of that name."""
        if name in self.logs:
            return DatasetLog(self, name, self.logs[name])
        if name in self.files:
            return DatasetLog(self, name, (name,))
        raise LogError(f"the dataset {self.name!r} has no {name!r}", allowed=", ".join([*self.logs, *(f for f in self.files if f.endswith(".urdf"))]))

    def missing(self) -> list[str]:
        """Files that are not in the data folder."""
        return [file for file in self.files if not (data_folder() / self.name / file).is_file()]

    def fetch(self, *, into: Path | None = None, progress: Callable[[str, float], None] | None = None) -> list[Path]:
        """Download what is missing and check every file. Raises LogError where that fails.

        Args:
            into: a data folder in place of the usual one.
            progress: called with the name of a file and the share of it that is here.
        """
        import pooch

        folder, paths = (into or data_folder()) / self.name, []
        for file, (remote, sha256) in self.files.items():
            bar = False if progress is None else _Bar(lambda share, file=file: progress(f"fetch {file}", share))
            try:
                path = pooch.retrieve(
                    f"{self.source}/{remote}", known_hash=f"sha256:{sha256}", fname=file, path=folder, downloader=pooch.HTTPDownloader(progressbar=bar)
                )
            except ValueError as error:  # what came is not what was published
                raise LogError(f"{self.name}: {file} could not be fetched ({str(error).splitlines()[0]})", where=str(folder), do=f"run it again, or put the file of {self.source} there") from None
            except OSError as error:
                cure = "free the disk, or name another folder with SYSID_DATA_DIR" if error.errno else f"check the network, or put the file of {self.source} there"
                raise LogError(f"{self.name}: {file} could not be fetched ({str(error).splitlines()[0]})", where=str(folder), do=cure) from None
            paths.append(Path(path))
        return paths


class _Bar:
    """What Pooch takes for a progress bar."""

    def __init__(self, tell: Callable[[float], None]):
        self.total, self._tell, self._done = 0, tell, 0

    def update(self, size: int) -> None:
        self._done += size
        self._tell(min(1.0, self._done / self.total) if self.total else 0.0)

    def reset(self) -> None:
        self._done = 0

    def close(self) -> None:
        self._tell(1.0)


@dataclass(frozen=True)
class DatasetLog:
    """One log of a dataset."""

    dataset: Dataset
    name: str
    files: tuple[str, ...]

    def locate(self) -> Path:
        """The main file, after every file of the log was found and its SHA-256 checked."""
        folder = data_folder() / self.dataset.name
        for file in self.files:
            path = folder / file
            if not path.is_file():
                raise LogError(f"{file} of the dataset {self.dataset.name!r} is not there", where=str(folder), do=f"run `sysid fetch {self.dataset.name}`, or set SYSID_DATA_DIR to the folder that holds {self.dataset.name}/")
            with path.open("rb") as opened:
                found = hashlib.file_digest(opened, "sha256").hexdigest()
            if found != self.dataset.files[file][1]:
                raise LogError(f"the SHA-256 {found[:12]}… is not the published {self.dataset.files[file][1][:12]}…", where=str(path), do=f"remove the file and run `sysid fetch {self.dataset.name}`")
        return folder / self.files[0]

    def open(self, path: Path) -> Table:
        """The log's table."""
        return self.dataset.opener(path)
