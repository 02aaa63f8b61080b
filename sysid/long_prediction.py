"""What is predicted over long logs: written to files of its own piece by piece as it is made, and
read from there.

Of the errors, sums are kept; whoever asks for the torques themselves has them read into memory.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .errors import SysidError
from .free_memory import released
from .model import Model
from .motion import Motion, Piece, Pieces
from .prediction import Prediction, States, Sums, joined_states, predict, states, units
from .unfinished import beside, temporary_folder
from .whole_files import ROWS

_ARRAYS = ("log", "t", "measured", "predicted", "use")
_GREATEST = 8  # torques of each joint that are remembered


class LongPrediction(Prediction):
    """As `Prediction`; its arrays are read from files whenever they are asked for. `files` hold
    what `to_dataframe` says, in order."""

    def __init__(self, joints: tuple[str, ...], units: tuple[str, ...], masked: bool) -> None:
        own = {
            "joints": joints,
            "units": units,
            "states": None,
            "files": [],
            "masked": masked,
            "_sums": None,
            "_greatest": None,
            "_samples": 0,
        }
        for name, value in own.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "_folder", temporary_folder(self))

    @property
    def place(self) -> Path:
        """Where the next part is to be written."""
        return self._folder / f"{len(self.files)}.parquet"

    def _took(self, part: _Part) -> None:
        """Count a part in, and write it where that is not done yet."""
        path = self.place
        if part.content is not None:
            _written(path, lambda: path.write_bytes(part.content))
        self.files.append(path)
        sums, greatest = part.sums, part.greatest
        if self._sums is not None:
            sums, greatest = self._sums + sums, np.concatenate([self._greatest, greatest])
        object.__setattr__(self, "_sums", sums)
        object.__setattr__(self, "_greatest", -np.sort(-greatest, axis=0)[:_GREATEST])
        object.__setattr__(self, "_samples", self._samples + part.samples)

    def parts(self):
        """As of `Prediction`."""
        return (self._read([path]) for path in self.files)

    def tables(self):
        """As of `Prediction`."""
        import polars as pl

        for path in self.files:
            released()
            part = pl.scan_parquet(path)
            rows = part.select(pl.len()).collect().item()
            yield from (part.slice(first, ROWS).collect() for first in range(0, rows, ROWS))

    def _read(self, paths: list[Path]) -> Prediction:
        import polars as pl

        table = pl.read_parquet(paths)
        own = lambda word: [f"{word}_{joint}" for joint in self.joints]  # noqa: E731
        taken = lambda word: table.select(own(word)).to_numpy()  # noqa: E731
        use = taken("used") if self.masked else None
        times = table["log"].to_numpy(), table["t"].to_numpy()
        return Prediction(
            *times, taken("measured"), taken("predicted"), use, self.joints, self.units, self.states
        )

    def thinned(self, most: int) -> Prediction:
        """As of `Prediction`."""
        many = len(self.files)
        count = min(max(2, most * many // max(self._samples, 1)), many)
        chosen = [k * (many - 1) // max(count - 1, 1) for k in range(count)]
        return self._read([self.files[k] for k in dict.fromkeys(chosen)])

    def lazy(self):
        """As of `Prediction`."""
        import polars as pl

        return pl.scan_parquet(self.files)

    def __getattr__(self, name: str):
        if name not in _ARRAYS:
            raise AttributeError(name)
        if name == "use" and not self.masked:
            return None
        word = {"measured": "measured_", "predicted": "predicted_", "use": "used_"}.get(name)
        wanted = [name] if word is None else [f"{word}{joint}" for joint in self.joints]
        table = self.lazy().select(wanted).collect()
        return table[name].to_numpy() if word is None else table.to_numpy()

    def _columns(self, joint: int) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        words = ("measured", "predicted", "used") if self.masked else ("measured", "predicted")
        wanted = [f"{word}_{self.joints[joint]}" for word in words]
        table = self.lazy().select(wanted).collect()
        own = [table[name].to_numpy() for name in wanted]
        return own[0], own[1], own[2] if self.masked else None

    def __repr__(self) -> str:
        errors = ", ".join(
            f"{joint} {rms:.4g}" for joint, rms in zip(self.joints, self.told()) if rms is not None
        )
        return f"<Prediction of {self._samples} samples: RMS {errors}>"

    @property
    def counts(self) -> np.ndarray:
        """(dof,) rows that count."""
        return self._sums.counts

    def greatest(self, count: int) -> np.ndarray:
        """As of `Prediction`, for a few."""
        return self._greatest[:count] if count <= _GREATEST else super().greatest(count)


def predicted(model: Model, x, motion: Motion) -> Prediction:
    """As `prediction.predict`; over long logs it is in files, in a temporary folder that goes with
    it."""
    if not isinstance(motion.pieces, Pieces):
        return predict(model, x, motion)
    out = LongPrediction(model.robot.joints, units(model.robot), motion.pieces.masked)
    firsts = np.cumsum([0, *(outline.samples for outline in motion.outlines)]).tolist()
    none = replace(motion, pieces=(), mapped=None)
    tasks = (
        (model, x, none, first, motion.samples, out.place.with_name(f"{number}.parquet"))
        for number, first in enumerate(firsts[:-1])
    )
    kept = []
    for part in motion.each(_part, tasks):
        out._took(part)
        kept.append(part.states)
    object.__setattr__(out, "states", joined_states(kept))
    return out


@dataclass(frozen=True)
class _Part:
    """What is predicted of one piece: its errors' sums, greatest torques, some of its states, and
    the file where this process could not put it in its place."""

    sums: Sums
    greatest: np.ndarray
    states: States
    samples: int
    content: bytes | None


def _part(
    piece: Piece, model: Model, x, motion: Motion, first: int, samples: int, path: Path
) -> _Part:
    found = predict(model, x, replace(motion, pieces=(piece,)))
    released()  # what filters and the regressor left free between what is held
    content = _put(found.to_dataframe(), path)
    where = states(piece, first, samples)
    return _Part(found.sums(), found.greatest(_GREATEST), where, len(found.t), content)


def _put(table, path: Path) -> bytes | None:
    """Write a part to its file; its content where that is on another machine."""
    how = {"compression": "uncompressed", "statistics": False, "row_group_size": ROWS}
    if not path.parent.is_dir():
        stream = io.BytesIO()
        table.write_parquet(stream, **how)
        return stream.getvalue()
    # under a name of its own: a worker that was given up may still be at the same part
    own = beside(path)
    _written(path, lambda: (table.write_parquet(own, **how), os.replace(own, path)))
    return None


def _written(path: Path, write: Callable[[], object]) -> None:
    import polars as pl

    try:
        write()
    except (OSError, pl.exceptions.PolarsError) as error:
        said = str(error).splitlines()[0]
        raise SysidError(
            f"predictions cannot be written ({said})",
            where=str(path.parent),
            do="free the disk, or name another folder in TMPDIR",
        ) from None
