"""What is predicted over long logs: written to files of its own piece by piece as it is made, and
read from there.

Of the errors, sums are kept; whoever asks for the torques themselves has them read into memory.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .errors import SysidError
from .estimate import Prediction, Sums, joined_states, predict, states, units
from .model import Model
from .motion import Motion, Pieces
from .unfinished import temporary_folder

_ARRAYS = ("log", "t", "measured", "predicted", "use")
_GREATEST = 8  # torques of each joint that are remembered


class LongPrediction(Prediction):
    """As `Prediction`; its arrays are read from files whenever they are asked for. `files` hold
    what `to_dataframe` says, in order."""

    def __init__(
        self, joints: tuple[str, ...], units: tuple[str, ...], masked: bool
    ) -> None:
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

    def _took(self, part: Prediction) -> None:
        """Write a part and count it in."""
        import polars as pl

        path = self._folder / f"{len(self.files)}.parquet"
        try:
            part.to_dataframe().write_parquet(path, compression="uncompressed", statistics=False)
        except (OSError, pl.exceptions.PolarsError) as error:
            said = str(error).splitlines()[0]
            raise SysidError(
                f"predictions cannot be written ({said})",
                where=str(self._folder),
                do="free the disk, or name another folder in TMPDIR",
            ) from None
        self.files.append(path)
        sums = part.sums()
        greatest = part.greatest(_GREATEST)
        if self._sums is not None:
            sums, greatest = self._sums + sums, np.concatenate([self._greatest, greatest])
        object.__setattr__(self, "_sums", sums)
        object.__setattr__(self, "_greatest", -np.sort(-greatest, axis=0)[:_GREATEST])
        object.__setattr__(self, "_samples", self._samples + len(part.t))

    def lazy(self):
        """As of `Prediction`."""
        import polars as pl

        return pl.scan_parquet(self.files)

    def __getattr__(self, name: str):
        if name not in _ARRAYS:
            raise AttributeError(name)
        import polars as pl

        if name == "use" and not self.masked:
            return None
        word = {"measured": "measured_", "predicted": "predicted_", "use": "used_"}.get(name)
        wanted = [name] if word is None else [f"{word}{joint}" for joint in self.joints]
        table = pl.scan_parquet(self.files).select(wanted).collect()
        return table[name].to_numpy() if word is None else table.to_numpy()

    def __repr__(self) -> str:
        errors = ", ".join(
            f"{joint} {rms:.4g}" for joint, rms in zip(self.joints, self.told()) if rms is not None
        )
        return f"<Prediction of {self._samples} samples: RMS {errors}>"

    @property
    def counts(self) -> np.ndarray:
        """(dof,) rows that count."""
        return self._sums.counts

    def sums(self) -> Sums:
        """As of `Prediction`."""
        return self._sums

    def greatest(self, count: int) -> np.ndarray:
        """As of `Prediction`, for a few."""
        return self._greatest[:count] if count <= _GREATEST else super().greatest(count)


def predicted(model: Model, x, motion: Motion) -> Prediction:
    """As `estimate.predict`; over long logs it is in files, in a temporary folder that goes with
    it."""
    if not isinstance(motion.pieces, Pieces):
        return predict(model, x, motion)
    out = LongPrediction(model.robot.joints, units(model.robot), motion.pieces.masked)
    kept, first = [], 0
    for piece in motion.pieces:
        out._took(predict(model, x, replace(motion, pieces=(piece,))))
        kept.append(states(piece, first, motion.samples))
        first += piece.samples
    object.__setattr__(out, "states", joined_states(kept))
    return out
