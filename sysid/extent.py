"""How large a motion is: what every piece of it adds to that, in one pass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .motion import Piece

_SAMPLED = 1000  # rows that say how large a motion is
_ARRAYS = ("t", "q", "qd", "qdd", "tau", "measured")


class Extent:
    """Top speed, greatest torque, highest and (of the other sign) lowest angle (dof,) so far, the
    longest log [s], and some of the rows.

    Args:
        samples: how many rows all pieces together have, as nearly as is known.
    """

    def __init__(self, samples: int) -> None:
        self.stride = max(1, samples // _SAMPLED)
        self.speed = self.torque = self.low = self.high = None
        self.duration: dict[int, float] = {}
        self._rows: list[tuple[Piece, Piece]] = []

    def add(self, piece: Piece, *, goes_on: bool = False) -> None:
        """Take one more piece.

        Args:
            goes_on: whether the log of the piece before goes on in it without a gap.
        """
        ends = {
            "speed": np.abs(piece.qd).max(0), "torque": np.abs(piece.tau).max(0), "low":
            -piece.q.min(0), "high": piece.q.max(0),
        }  # fmt: skip
        for name, own in ends.items():
            before = getattr(self, name)
            setattr(self, name, own if before is None else np.maximum(before, own))
        before = self.duration.get(piece.log, 0.0)
        length = float(np.ptp(piece.t))
        self.duration[piece.log] = (
            before + piece.samples * piece.step if goes_on else max(before, length)
        )
        picked = np.arange(piece.core.start, piece.core.stop - 1, self.stride)
        self._rows.append((_at(piece, picked), _at(piece, picked + 1)))

    def sample(self) -> Piece:
        """Some rows of the motion, then the row after each."""
        parts = [one for own in zip(*self._rows) for one in own]
        first = parts[0]
        shared = [name for name in first.signals if all(name in part.signals for part in parts)]
        arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS}
        signals = {name: np.concatenate([part.signals[name] for part in parts]) for name in shared}
        return replace(first, **arrays, signals=signals, core=slice(0, len(arrays["t"])))


def _at(piece: Piece, rows: np.ndarray) -> Piece:
    """A copy of some rows, as logged: unfiltered, all counting."""
    arrays = {name: getattr(piece, name)[rows] for name in _ARRAYS}
    signals = {name: values[rows] for name, values in piece.signals.items()}
    return replace(
        piece, **arrays, signals=signals, use=None, smoother=None, sight=None, load=None,
        deflection=None, weight=None,
    )  # fmt: skip
