"""A motion from a file, as `sysid design` writes it, for a simulated robot to play."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import LogError
from ..readers import open_table
from .motion import Reference


@dataclass(frozen=True)
class Played:
    """t (n,) [s] from zero; q (n, dof)."""

    t: np.ndarray
    q: np.ndarray

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.t[-1])

    def reference(self, t) -> Reference:
        """The motion at times t, at rest before it begins and after it ends."""
        from scipy.interpolate import make_interp_spline

        inside = np.clip(t, 0.0, self.duration)
        spline = make_interp_spline(self.t, self.q, k=5)
        moves = ((t >= 0.0) & (t <= self.duration))[:, None]
        return Reference(
            t, spline(inside), np.where(moves, spline(inside, 1), 0.0), np.where(moves, spline(inside, 2), 0.0)
        )


def read_trajectory(path: Path, joints: tuple[str, ...]) -> Played:
    """The columns t and q_JOINT of a file.

    Raises:
        LogError: no such file or column, or times that do not rise.
    """
    table = open_table(path)
    names = ["t", *(f"q_{joint}" for joint in joints)]
    if missing := [name for name in names if name not in table.names]:
        raise LogError(f"the trajectory has no column {missing[0]!r}", where=str(path), allowed=table.some_names())
    found = table.load(names)
    t = np.asarray(found["t"], dtype=float)
    q = np.stack([np.asarray(found[name], dtype=float) for name in names[1:]], axis=1)
    if len(t) < 6 or not (np.diff(t) > 0.0).all() or not np.isfinite(q).all():
        raise LogError("the trajectory is no motion", where=str(path), allowed="six rows or more, rising t, finite angles")
    return Played(t - t[0], q)
