"""How large a motion is: what every piece of it adds to that, in one pass."""

from __future__ import annotations

from dataclasses import dataclass, replace

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

    def add(self, piece: Piece) -> None:
        """Take one more piece."""
        self.take(reach_of(piece, self.stride))

    def take(self, own: Reach, *, goes_on: bool = False) -> None:
        """Take what one more piece reaches.

        Args:
            goes_on: whether the log of the piece before goes on in it without a gap.
        """
        for name, end in own.ends.items():
            before = getattr(self, name)
            setattr(self, name, end if before is None else np.maximum(before, end))
        before = self.duration.get(own.log, 0.0)
        self.duration[own.log] = before + own.core if goes_on else max(before, own.length)
        self._rows.append(own.rows)

    def sample(self) -> Piece:
        """Some rows of the motion, then the row after each."""
        parts = [one for own in zip(*self._rows) for one in own]
        first = parts[0]
        shared = [name for name in first.signals if all(name in part.signals for part in parts)]
        arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS}
        signals = {name: np.concatenate([part.signals[name] for part in parts]) for name in shared}
        return replace(first, **arrays, signals=signals, core=slice(0, len(arrays["t"])))


@dataclass(frozen=True)
class Reach:
    """What a piece adds to an extent: its log, its ends (dof,), how long it and its core are [s],
    and some of its rows with the row after each."""

    log: int
    ends: dict[str, np.ndarray]
    length: float
    core: float
    rows: tuple[Piece, Piece]


def reach_of(piece: Piece, stride: int) -> Reach:
    """How far a piece reaches, and one row in `stride`."""
    ends = {
        "speed": np.abs(piece.qd).max(0), "torque": np.abs(piece.tau).max(0), "low":
        -piece.q.min(0), "high": piece.q.max(0),
    }  # fmt: skip
    picked = np.arange(piece.core.start, piece.core.stop - 1, stride)
    rows = _at(piece, picked), _at(piece, picked + 1)
    return Reach(piece.log, ends, float(np.ptp(piece.t)), piece.samples * piece.step, rows)


def _at(piece: Piece, rows: np.ndarray) -> Piece:
    """A copy of some rows, as logged: unfiltered, all counting."""
    arrays = {name: getattr(piece, name)[rows] for name in _ARRAYS}
    signals = {name: values[rows] for name, values in piece.signals.items()}
    return replace(
        piece, **arrays, signals=signals, use=None, smoother=None, sight=None, load=None,
        deflection=None, weight=None,
    )  # fmt: skip
