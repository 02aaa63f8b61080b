"""One joint from all sides: its torque over time, its residual against where it is and how fast,
and the robot at the moment under the cursor.

Everything is of the same rows as the fit's own errors, in the same band: the test logs, or the
training logs, at the rate of the log. A window of time is drawn with every sample where there are
few, and with the greatest and the least of each stretch where there are many.
"""

from __future__ import annotations

import csv
import io

import numpy as np

from ..errors import SysidError
from ..estimate import Fit
from ..prediction import Prediction
from ..report import charts, solids
from ..report.decimate import kept
from ..report.fitted import log_names, placed
from ..report.words import band, units
from . import panels
from .rows import Columns, Shown, rms, same_rows

MOST = 6000  # samples of a chart before it is thinned: two of each line for each pixel
_DOTS = 3000  # of a cloud
_FRAMES = 400  # of the robot
_CELLS = (28, 20)  # of a map, over position and speed
PARTS = ("test", "train")


class Workspace:
    """A fit, ready to be looked at. Safe to use from several threads."""

    def __init__(self, fit: Fit):
        self.fit = fit
        self._lines: dict[str, dict] = {}
        self._told: dict[str, list[float | None]] = {}
        self._columns: dict[tuple[str, int], Columns] = {}
        self._times: dict[str, np.ndarray] = {}
        self._films: dict[str, dict] = {}

    def prediction(self, part: str) -> Prediction:
        """The prediction of a part of the logs. Raises SysidError: there is none."""
        if part not in PARTS or part not in self.fit.predictions:
            raise SysidError(f"there is no part {part!r}", allowed=", ".join(PARTS), do="reload")
        return self.fit.predictions[part]

    def told(self, part: str) -> list[float | None]:
        """The RMS of each joint on a part of the logs, as the fit has it everywhere."""
        if part not in self._told:
            self._told[part] = self.prediction(part).told()
        return self._told[part]

    def times(self, part: str) -> np.ndarray:
        """(n,) of the rows of a part [s], by the clocks of their logs."""
        if part not in self._times:
            self._times[part] = self.prediction(part).t
        return self._times[part]

    def columns(self, part: str, joint: int) -> Columns:
        """What is drawn of a joint; of the one looked at last it is kept at hand."""
        found = self._columns.get((part, joint))  # another thread may put its own in its place
        if found is None:
            found = self.prediction(part).of_joint(joint)
            self._columns = {(part, joint): found}
        return found

    def joint(self, number: int) -> str:
        """The name of a joint. Raises SysidError: there is none of that number."""
        if not 0 <= number < len(self.fit.joints):
            raise SysidError("there is no such joint", do="reload")
        return self.fit.joints[number]

    def line(self, part: str) -> dict:
        """The logs of a part end to end, the first from 0 s: as `charts.timeline` has them."""
        if part not in self._lines:
            found = self.prediction(part)
            parts = {part: (found.log, self.times(part), log_names(self.fit, part))}
            self._lines[part] = charts.timeline(parts)[part]
        return self._lines[part]

    # ---- a window of time

    def window(
        self, part: str, joint: int, low=None, high=None, beside: Shown | None = None
    ) -> dict:
        """Torque measured and predicted, and the residual, between two times.

        Args:
            low, high: on the axis of the logs end to end [s]; None for all of it.
            beside: the same logs under another model, laid over these, with the difference.

        Returns:
            {"chart", "from", "to", "samples", "drawn", "whole": [first, last], "joint", "unit",
            "left_out", "rms", "here", "beside", "laid", "band"}: rows in sight that do not count,
            RMS of all rows that count, of those of the window, and of all of the other model's own
            (None where there is none); whether its rows are among these.
        """
        name, line = self.joint(joint), self.line(part)
        t, (measured, predicted, left) = line["t"], self.columns(part, joint)
        low, high = self._bounds(t, low, high)
        # one row beyond either edge, so that lines reach it
        first, last = np.searchsorted(t, low) - 1, np.searchsorted(t, high, side="right") + 1
        rows = slice(max(int(first), 0), min(int(last), len(t)))
        lines = {
            "measured": measured[rows], "predicted": predicted[rows], "residual": left[rows],
        }  # fmt: skip
        other = None if beside is None else same_rows(beside, self, part, joint)
        if other is not None:
            there, missed = (values[rows] for values in other)
            lines |= {"predicted beside": there, "residual beside": missed}
            # where rows do not count, neither model is asked
            lines["difference"] = missed - lines["residual"]
        keep = np.arange(rows.stop - rows.start)
        if len(keep) > MOST:  # as many in all, however many lines there are
            each = MOST // len(lines)
            keep = np.unique(np.concatenate([kept(v, each) for v in lines.values()]))
        chart = panels.time(
            name, units(self.fit)[name][0], t[rows][keep], {w: v[keep] for w, v in lines.items()},
            own=self._own_clock(part, rows.start + keep), breaks=_breaks(line, rows.start + keep),
            window=(low, high), shaded=self._disturbed(part, name, low, high),
        )  # fmt: skip
        inside = (t >= low) & (t <= high)
        return {
            "chart": chart, "from": low, "to": high, "samples": int(inside.sum()),
            "drawn": int(len(keep)), "whole": [float(t[0]), float(t[-1])], "joint": name,
            "unit": units(self.fit)[name][0], "left_out": int(np.isnan(left[inside]).sum()),
            "rms": (whole := self.told(part)[joint]),
            "here": whole if inside.all() else rms(left[inside]),
            "beside": None if beside is None else beside.told(part)[joint],
            "laid": other is not None, "band": band(self.fit),
        }  # fmt: skip

    def csv(self, part: str, joint: int, low=None, high=None) -> str:
        """Every row of a window of time as text of a CSV file: the log, its own clock, torques."""
        name, line = self.joint(joint), self.line(part)
        low, high = self._bounds(line["t"], low, high)
        rows = np.flatnonzero((line["t"] >= low) & (line["t"] <= high))
        unit = units(self.fit)[name][0]
        heads = [
            "log",
            "t [s]",
            *(f"{word} [{unit}]" for word in ("measured", "predicted", "residual")),
        ]
        out = io.StringIO()
        sheet = csv.writer(out, lineterminator="\n")
        sheet.writerow(heads)
        own, t = self.columns(part, joint), self.times(part)
        for k, (log, _) in zip(rows, self._own_clock(part, rows)):
            torques = (repr(float(v[k])) if np.isfinite(v[k]) else "" for v in own)
            sheet.writerow([log, repr(float(t[k])), *torques])
        return out.getvalue()

    @staticmethod
    def _bounds(t, low, high) -> tuple[float, float]:
        """The window that is meant. Raises SysidError."""
        if not len(t):
            raise SysidError("these logs have no rows")
        low, high = (t[0] if low is None else low), (t[-1] if high is None else high)
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            raise SysidError("a window of time needs two numbers, the first the less")
        return float(low), float(high)

    def own_clocks(self, part: str, low: float, high: float) -> list[tuple[str, float, float]]:
        """The logs that a stretch of time touches, and from when to when by their own clocks."""
        line, t, out = self.line(part), self.times(part), []
        low, high = self._bounds(line["t"], min(low, high), max(low, high))
        for begin, end, name in line["spans"]:
            rows = (line["t"] >= max(low, begin)) & (line["t"] <= min(high, end))
            if rows.any():
                own = t[rows]
                out.append((name, float(f"{own.min():.9g}"), float(f"{own.max():.9g}")))
        return out

    def _disturbed(self, part: str, joint: str, low, high) -> list[tuple[float, float, str]]:
        """What disturbed a joint's log in a window: from, to, kind."""
        line = self.line(part)
        mine = [e for e in self.fit.events if e["part"] == part and joint in e["joints"]]
        spans = [(*span, e["kind"]) for e in mine for span in placed(e, line)]
        return [span for span in spans if span[1] >= low and span[0] <= high]

    def _own_clock(self, part: str, rows) -> list[list]:
        """Of each row its log's name and the time by the log's own clock [s]."""
        line = self.line(part)
        names = [name.rpartition("/")[2] for _, _, name in line["spans"]]
        ends = np.array([end for _, end, _ in line["spans"]])
        which = np.minimum(np.searchsorted(ends, line["t"][rows] - 1e-9), len(names) - 1)
        clock = charts.rounded(self.times(part)[rows], 6)
        return [[names[k], t] for k, t in zip(which.tolist(), clock)]

    # ---- the residual against position and speed

    def cloud(self, part: str, joint: int) -> dict:
        """The residual against position and against speed, each dot coloured by the direction of
        motion, and its mean over both.

        Returns:
            {"position", "speed", "map": charts, "t": (m,) [s] of the dots, "joint", "unit"}.
        """
        name, found = self.joint(joint), self.prediction(part)
        states = found.states
        if states is None:
            raise SysidError("where the joints were was not kept", do="reload")
        left = self.columns(part, joint)[2][states.index]
        q, qd = states.q[:, joint], states.qd[:, joint]
        seen = np.flatnonzero(np.isfinite(left))
        dots = seen[:: max(1, -(-len(seen) // _DOTS))]
        force, base = units(self.fit)[name]
        rest = 1e-3 * float(np.abs(qd).max(initial=0.0))
        direction = np.where(np.abs(qd) > rest, np.sign(qd), 0.0)
        t = self.line(part)["t"][states.index]
        drawn = {
            word: panels.dots(
                word, name, values[dots], left[dots], direction[dots], t[dots], force, unit
            )
            for word, values, unit in (("position", q, base), ("speed", qd, f"{base}/s"))
        }
        drawn["map"] = panels.mean_map(name, _binned(q[seen], qd[seen], left[seen]), force, base)
        return {**drawn, "t": charts.rounded(t[dots], 6), "joint": name, "unit": force}

    # ---- the robot

    def film(self, part: str) -> dict:
        """Where the robot's joints and links are over a part of the logs.

        Returns:
            {"chart": of the first moment, "t": (f,) [s], "links": (f, 3, k), None between links,
            "joints": (f, 3, dof), "names"}.
        """
        if part not in self._films:
            self._films[part] = self._film(part)
        return self._films[part]

    def _film(self, part: str) -> dict:
        states, robot = self.prediction(part).states, self.fit.model.robot
        if states is None or not len(states.index):
            raise SysidError("where the joints were was not kept", do="reload")
        frames = np.unique(np.linspace(0, len(states.index) - 1, _FRAMES).astype(int))
        rows = {body.joint: body.row for body in robot.bodies if body.kind == "link"}
        own = [rows[joint] for joint in self.fit.joints]
        links, joints = [], []
        for k in frames:
            placed = solids.frames(robot, states.q[k])
            ends = solids.skeleton(robot, placed)
            links.append(np.concatenate([np.array([a, b, [np.nan] * 3]) for a, b in ends]).T)
            joints.append(np.array([placed[row].translation for row in own]).T)
        chart = panels.robot(np.array(links), joints[0], list(self.fit.joints))
        t = self.line(part)["t"][states.index[frames]]
        return {
            "chart": chart, "t": charts.rounded(t, 6), "links": _listed(links),
            "joints": _listed(joints), "names": list(self.fit.joints),
        }  # fmt: skip


def workspace_page(workspace: Workspace, steps: dict) -> dict:
    """What the page needs of a fit that is yet to be diagnosed: its joints, and its steps."""
    unit = units(workspace.fit)
    joints = [{"name": j, "unit": unit[j][0]} for j in workspace.fit.joints]
    return {"joints": joints, "converged": bool(workspace.fit.solution.converged), **steps}


def _listed(frames) -> list:
    return [[charts.rounded(axis, 4) for axis in frame] for frame in frames]


def _breaks(line: dict, rows) -> np.ndarray:
    """Places in a choice of rows before which the log was interrupted."""
    at = np.searchsorted(rows, line["breaks"])
    return np.unique(at[(at > 0) & (at < len(rows))])


def _binned(q, qd, left) -> dict:
    """Edges over position and speed, and the mean residual and the number of rows in each cell, as
    a failure's map has them."""
    edges = [_edges(values, cells) for values, cells in zip((q, qd), _CELLS)]
    count = np.histogram2d(q, qd, bins=edges)[0]
    total = np.histogram2d(q, qd, bins=edges, weights=left)[0]
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return {"q": edges[0], "qd": edges[1], "mean": mean, "rows": count.astype(int)}


def _edges(values, cells: int) -> np.ndarray:
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)
    return np.linspace(low, high if high > low else low + 1.0, cells + 1)
