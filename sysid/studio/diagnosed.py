"""A diagnosed experiment as the page shows it: the report's own sections, and the charts that it asks for one by one."""

from __future__ import annotations

import json
from functools import cache

from ..estimate import Fit
from ..report.sections import sections
from ..report.steps import steps
from ..report.words import units
from ..vocabulary import describe, find, vocabulary
from .workspace import Workspace

ORDER = ("verdict", "workspace", "steps", "suspects", "torque", "failures", "detectable", "parameters", "bodies", "provenance")


class Diagnosed:
    """Everything about one text of the experiment file that the page may ask for, made once."""

    def __init__(self, sha: str, fit: Fit, said: dict):
        """said: the document of the diagnosis."""
        self.sha, self.fit, self.said = sha, fit, said
        self.workspace = Workspace(fit)
        made = sections(fit, self.said, [])
        self._html = {name: {"title": section["title"], "html": section["html"]} for name, section in made.items() if name != "steps"}
        self._charts = {chart["id"]: dumped(chart) for section in made.values() for chart in section["charts"]}

    @property
    def samples(self) -> int:
        """Samples that it keeps in memory."""
        return sum(self.fit.samples.values())

    def offered(self) -> list[tuple[int, int]]:
        """(step, number of its finding) of the steps that the diagnosis names, in order."""
        heads = {f["joins_as_step"]: k for k, f in reversed(list(enumerate(self.said["findings"]))) if f["joins_as_step"]}
        return sorted(heads.items())

    def page(self, history: list[dict]) -> dict:
        """What the page needs to show itself, but for the charts."""
        made = steps(self.fit, self.said, history)
        self._charts |= {chart["id"]: dumped(chart) for chart in made.charts}
        joints, unit = self.fit.joints, units(self.fit)
        offered = [{"finding": k, "step": step, "effect": self.said["findings"][k]["effect"], "joint": self.said["findings"][k]["joint"]} for step, k in self.offered()]
        return {
            "sha": self.sha, "sections": {**self._html, "steps": {"title": made.title, "html": made.html()}}, **offers(),
            "joints": [{"name": j, "unit": unit[j][0]} for j in joints],
            "findings": [{"effect": f["effect"], "joint": f["joint"]} for f in self.said["findings"]],
            "verdict": [{"joint": v["joint"], "status": v["status"]} for v in self.said["verdict"]], "offered": offered,
            "made": self.said.get("made"), "converged": bool(self.fit.solution.converged),
        }  # fmt: skip

    def chart(self, name: str) -> bytes | None:
        """The JSON of a chart."""
        return self._charts.get(name)


def offers() -> dict:
    """What a page holds whatever was found: its sections in order, and the effects that can be tried."""
    return {"order": ORDER, "vocabulary": spoken()}


@cache
def spoken() -> list[dict]:
    """The effects that may be added, each with what it says."""
    found = {name: find(name) for name in vocabulary()}
    return [
        {"effect": name, "scope": effect.scope, "says": (said := describe(effect))["summary"].replace("`", ""), "options": [{"name": o, "says": words} for o, words in said["options"].items()]}
        for name, effect in found.items()
    ]  # fmt: skip


def step_name(step: dict) -> str:
    """A step of the history in words."""
    if step.get("added") is None:
        return "start"
    return f"+ {step['added']}" + ("" if step.get("joint") in (None, "*") else f" on {step['joint']}")


def dumped(value) -> bytes:
    """Strict JSON."""
    return json.dumps(value, allow_nan=False, separators=(",", ":"), ensure_ascii=False).encode()
