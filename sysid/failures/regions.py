"""Where a model fails: the joints, speeds, angles, times and frequencies that hold most of its
squared error."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..prediction import Prediction
from ..view import View
from .held_out import HeldOut
from .stretches import Stretches, stretches

_CUTS, _HALF = 10, 0.5  # quantiles a region may begin or end at; of the squared error
_MAP, _WINDOW = 12, 0.5  # cells of a map along a side; s
_NEAR = 0.02  # of what training logs span: so near to it is no new place
_BANDS = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 15.0, 30.0, 60.0, 125.0, 250.0, 500.0)  # Hz


@dataclass(frozen=True)
class Region:
    """A stretch of one variable, from `low` to `high`, that holds `error` of the squared error in
    `rows` of the rows; new: the share of that error which lies where no training log was."""

    variable: str
    unit: str
    low: float
    high: float
    error: float
    rows: float
    new: float = 0.0

    @property
    def unknown(self) -> bool:
        """Whether most of it lies where nothing was fitted."""
        return self.new > _HALF

    def words(self) -> str:
        """As a sentence says it."""
        what = {"q": "angle", "qd": "speed", "time": "time"}.get(self.variable, self.variable)
        where = f"{what} {self.low:.3g} to {self.high:.3g} {self.unit}"
        error, rows = f"{100 * self.error:.0f} %", f"{100 * self.rows:.0f} %"
        new = ", where the training logs were not" if self.unknown else ""
        return f"{error} of the squared error lies in the {rows} of the rows with {where}{new}"


@dataclass(frozen=True)
class Failure:
    """Where one joint's residual is: its share of all joints' error in units of their noise, the
    stretches of time and the regions most crowded with error, a map of the mean residual over
    (q, qd), the error over time,
    and over frequency.

    map: {"q": edges (m + 1,), "qd": edges (m + 1,), "mean": (m, m) [N m], NaN where no row is,
    "rows": (m, m)}.
    time: {"log": (k,), "start": (k,) [s], "rms": (k,)}.
    frequency: {"edges": (k + 1,) [Hz], "share": (k,)}.
    """

    joint: str
    share: float
    stretches: Stretches | None
    regions: tuple[Region, ...]
    map: dict = field(repr=False)
    time: dict = field(repr=False)
    frequency: dict = field(repr=False)

    def words(self) -> list[str]:
        """Sentences, the most telling first."""
        first = [self.stretches.words()] if self.stretches else []
        return first + [region.words() for region in self.regions]

    @property
    def parts(self) -> tuple:
        """The stretches of time that hold most of it; none where it is spread out."""
        return self.stretches.parts if self.stretches else ()


def failures(held_out: HeldOut, raw: Prediction, levels, view: View) -> list[Failure]:
    """Where each joint's test residual is.

    Args:
        raw: measured and predicted torque of the test logs as the fit sees them, for the
            frequencies.
        levels: (dof,) noise floors, in which the joints' errors are compared. view: what the model
            was settled on.
    """
    robot, rows, known = held_out.model.robot, held_out.rows, held_out.variables
    least = max(1e-9 * np.max(levels), 1e-100)  # of joints that were braked all the time
    weighted = (held_out.rms() / np.maximum(levels, least)) ** 2
    runs = _runs(raw)
    out, crowded = [], stretches(held_out, view.motion, view.weights)
    for j, joint in enumerate(robot.joints):
        use = rows.use[:, j]
        left = held_out.residual[use, j]
        square = left**2
        regions = []
        if square.sum() > 0:
            for name in ("q", "qd"):
                unit, values = known[f"{name}_{joint}"]
                region = _crowded(name, unit, values[use], square)
                trained = [getattr(piece, name)[:, j] for piece in view.motion.pieces]
                regions.append(region and _beyond(region, values[use], square, trained))
            regions.append(_crowded("time", "s", rows.t[use], square))
        regions = sorted(
            (r for r in regions if r is not None and r.error - r.rows > 0.1),
            key=lambda r: r.rows - r.error,
        )
        q, qd = (known[f"{name}_{joint}"][1][use] for name in ("q", "qd"))
        residuals = [raw.residual[s, j] for s in runs]
        steps = [raw.t[s.start + 1] - raw.t[s.start] for s in runs]
        out.append(
            Failure(
                joint,
                float(weighted[j] / max(weighted.sum(), 1e-300)),
                crowded[j],
                tuple(regions),
                _map(q, qd, left),
                _windows(rows.t[use], rows.log[use], square),
                _bands(residuals, steps),
            )
        )
    return out


def _runs(raw: Prediction) -> list[slice]:
    """Contiguous rows, longer than a few samples."""
    step = np.diff(raw.t)
    usual = np.median(step) if len(step) else 1.0
    cuts = np.flatnonzero((np.diff(raw.log) != 0) | (step > 1.5 * usual) | (step <= 0)) + 1
    edges = np.concatenate([[0], cuts, [len(raw.t)]])
    return [slice(a, b) for a, b in zip(edges, edges[1:]) if b - a > 8]


def _crowded(name: str, unit: str, values, square) -> Region | None:
    """The shortest stretch, in rows, that holds half of the squared error, if it is clearly less
    than half of the rows."""
    order = np.argsort(values)
    x, total = values[order], np.cumsum(square[order]) / square.sum()
    cuts = np.linspace(0, len(x) - 1, 4 * _CUTS + 1).astype(int)
    best = None
    for a in range(len(cuts) - 1):
        before = total[cuts[a] - 1] if cuts[a] else 0.0
        b = np.searchsorted(total[cuts], before + _HALF)
        if b >= len(cuts) or b <= a:
            continue
        rows = (cuts[b] - cuts[a]) / (len(x) - 1)
        if best is None or rows < best[0]:
            best = (rows, a, b, total[cuts[b]] - before)
    if best is None or best[0] > 0.4:
        return None
    rows, a, b, error = best
    return Region(name, unit, float(x[cuts[a]]), float(x[cuts[b]]), float(error), float(rows))


def _beyond(region: Region, values, square, trained) -> Region:
    """A region with the share of its error beyond the values of all training logs, each (n,)."""
    inside = (values >= region.low) & (values <= region.high)
    low, high = min(own.min() for own in trained), max(own.max() for own in trained)
    new = inside & (np.maximum(low - values, values - high) > _NEAR * (high - low))
    return replace(region, new=float(square[new].sum() / max(square[inside].sum(), 1e-300)))


def _map(q, qd, residual) -> dict:
    if not len(q):
        q = qd = residual = np.zeros(1)
    edges = [
        np.linspace(v.min(), v.max() if np.ptp(v) > 0 else v.min() + 1.0, _MAP + 1) for v in (q, qd)
    ]
    rows, *_ = np.histogram2d(q, qd, bins=edges)
    total, *_ = np.histogram2d(q, qd, bins=edges, weights=residual)
    return {
        "q": edges[0],
        "qd": edges[1],
        "mean": np.divide(total, rows, out=np.full(rows.shape, np.nan), where=rows > 0),
        "rows": rows,
    }


def _windows(t, log, square) -> dict:
    if not len(t):
        return {"log": np.zeros(0, dtype=int), "start": np.zeros(0), "rms": np.zeros(0)}
    key = log.astype(np.int64) * 10**9 + np.floor(t / _WINDOW).astype(np.int64)
    unique, index = np.unique(key, return_inverse=True)
    rms = np.sqrt(np.bincount(index, square) / np.bincount(index))
    return {"log": unique // 10**9, "start": (unique % 10**9) * _WINDOW, "rms": rms}


def _bands(residuals, steps) -> dict:
    edges = np.array(_BANDS)
    total = np.zeros(len(edges) - 1)
    for residual, step in zip(residuals, steps):
        frequency = np.fft.rfftfreq(len(residual), step)
        windowed = (residual - residual.mean()) * np.hanning(len(residual))
        power = np.abs(np.fft.rfft(windowed)) ** 2
        total += np.histogram(frequency, bins=edges, weights=power)[0]
    last = int(np.flatnonzero(total > 0).max(initial=0)) + 1
    return {"edges": edges[: last + 1], "share": total[:last] / max(total.sum(), 1e-300)}
