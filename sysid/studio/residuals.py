"""Answers to clicks that need no refit: what a suspect would explain, what is missed in a stretch of time, steps compared.

All of them look at the test rows on which the diagnosis asked its questions: low-passed, thinned, few enough to keep.
"""

from __future__ import annotations

import threading
from functools import cached_property

import numpy as np

from ..diagnose.diagnosis import Diagnosis
from ..errors import SysidError
from ..failures import HeldOut
from ..model import ROBOT
from ..report import charts
from ..report.decimate import broken
from ..report.words import units

_MOST = 3000  # points of a line


class Residuals:
    """A diagnosis, ready to answer."""

    def __init__(self, diagnosis: Diagnosis):
        self.diagnosis, self.first = diagnosis, diagnosis.first
        self._removed: dict[int, np.ndarray] = {}
        self._lock = threading.Lock()

    @cached_property
    def line(self) -> dict:
        """The test logs end to end."""
        rows = self.first.rows
        return charts.timeline({"test": (rows.log, rows.t, [])})["test"]

    @cached_property
    def _before(self) -> list[HeldOut]:
        """Of each suspect, the model that it joins: the first one, with the steps before it."""
        out = []
        for claim in self.diagnosis.claims:
            view = claim.step.before
            first = view is self.diagnosis.view
            own = self.first if first else HeldOut(view.settled, self.first.test)
            out += [own] * len(claim.findings)
        return out

    def warm(self, tell=lambda share: None) -> None:
        """Prepare the answers on every suspect."""
        for k in range(len(self.diagnosis.findings)):
            self.removed(k)
            tell((k + 1) / len(self.diagnosis.findings))

    def removed(self, k: int) -> np.ndarray:
        """(n, dof) what the suspect with a number takes of the residual, everything else refitted: on top of the steps
        before its own."""
        if not 0 <= k < len(self.diagnosis.findings):
            raise SysidError("there is no such suspect", do="reload")
        with self._lock:
            if k not in self._removed:
                self._removed[k] = self._explained(k)
            return self._removed[k]

    def _explained(self, k: int) -> np.ndarray:
        after = HeldOut(self.diagnosis.findings[k].member.view.settled, self.first.test)
        return (self._before[k].residual - after.residual) * self.first.rows.use

    def own(self, k: int) -> list[int]:
        """The joints that a suspect is judged by."""
        joint = self.diagnosis.findings[k].candidate.joint
        return list(range(len(self.diagnosis.fit.joints))) if joint == ROBOT else [joint]

    # ---- a joint's residual over time, with what a suspect would explain

    def residual(self, joint: int, k: int | None = None) -> dict:
        """The chart of a joint's residual on the test logs, and over it what a suspect explains."""
        fit = self.diagnosis.fit
        if not 0 <= joint < len(fit.joints):
            raise SysidError("there is no such joint", do="reload")
        name, unit = fit.joints[joint], units(fit)[fit.joints[joint]][0]
        values = {"residual": self.first.residual[:, joint]}
        if k is not None:
            values[f"explained by {self.diagnosis.findings[k].effect}" if 0 <= k < len(self.diagnosis.findings) else ""] = self.removed(k)[:, joint]
        use = self.first.rows.use[:, joint]
        data = []
        for (word, own), colour, width in zip(values.items(), (charts.VERMILLION, charts.BLUE), (1.1, 1.8)):
            t, y = broken(self.line["t"], np.where(use, own, np.nan), self.line["breaks"], _MOST)
            data.append({
                "type": "scatter", "mode": "lines", "x": charts.rounded(t, 6), "y": charts.rounded(y, 4), "name": charts.plain(word), "line": {"color": colour, "width": width},
                "connectgaps": False, "hovertemplate": f"{charts.plain(word)}: %{{y:.4g}} {unit}",
            })  # fmt: skip
        end = max((span[1] for span in self.line["spans"]), default=1.0)
        layout = {
            "xaxis": charts.axis("time, test logs end to end [s]", range=[0.0, float(f"{end:.6g}")]), "yaxis": charts.axis(f"residual [{unit}]", zeroline=True), "showlegend": True,
            "legend": charts.LEGEND, "hovermode": "x", "dragmode": "select", "selectdirection": "h",
            "margin": {"l": 66, "r": 14, "t": 30, "b": 46},
        }  # fmt: skip
        chart = charts.chart("look", f"Residual of {name} over the test logs", data, layout, height=320)
        said = {"joint": name, "unit": unit, "rms": self._rms(joint, None), "explained": None if k is None else self._rms(joint, self.removed(k))}
        return {"chart": chart, **said}

    def _rms(self, joint: int, removed: np.ndarray | None) -> float:
        left = self.first.residual[:, joint] - (0.0 if removed is None else removed[:, joint])
        return float(np.sqrt((left**2).sum() / max(self.first.rows.use[:, joint].sum(), 1)))

    # ---- a stretch of time

    def stretch(self, low: float, high: float) -> dict:
        """What the model misses between two times of the test logs laid end to end.

        Returns:
            {"from", "to", "rows", "joints": [{joint, unit, here, whole}], "suspects": [{finding, effect, joint, share}]},
            share of the squared residual there that a suspect would take, the largest first.
        """
        if not (np.isfinite(low) and np.isfinite(high)):
            raise SysidError("a stretch of time needs two numbers")
        low, high = min(low, high), max(low, high)
        inside = (self.line["t"] >= low) & (self.line["t"] <= high)
        fit, residual, use = self.diagnosis.fit, self.first.residual, self.first.rows.use
        unit = units(fit)
        rms = lambda which: np.sqrt((residual[which] ** 2).sum(0) / np.maximum(use[which].sum(0), 1))  # noqa: E731
        here, whole = rms(inside), rms(slice(None))
        joints = [{"joint": j, "unit": unit[j][0], "here": float(a), "whole": float(b)} for j, a, b in zip(fit.joints, here, whole)]
        suspects = []
        for k, finding in enumerate(self.diagnosis.findings):
            own, removed = self.own(k), self.removed(k)
            before = residual[inside][:, own]
            square = float((before**2).sum())
            if square > 0:
                after = before - removed[inside][:, own]
                suspects.append({"finding": k, "effect": finding.effect, "joint": finding.joint, "share": 1.0 - float((after**2).sum()) / square})
        suspects.sort(key=lambda s: -s["share"])
        return {"from": low, "to": high, "rows": int(inside.sum()), "joints": joints, "suspects": [s for s in suspects if s["share"] > 0.01][:4]}


def compared(steps: list[dict], one: int, other: int) -> dict:
    """The held-out errors of two steps and their difference. Raises SysidError."""
    if not (0 <= one < len(steps) and 0 <= other < len(steps)):
        raise SysidError("there is no such step", do="reload")
    first, second = steps[one]["rms_test"], steps[other]["rms_test"]
    return {"from": one, "to": other, "joints": [{"joint": j, "from": first[j], "to": second[j], "delta": second[j] - first[j]} for j in first if j in second]}
