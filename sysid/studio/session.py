"""One experiment at work: its file, the job that runs on it, and what was found under each of its texts."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

from .. import comparison, loop, pipeline, results
from ..addition import spelled
from ..diagnose.diagnosis import diagnose
from ..effect import find, vocabulary
from ..errors import SysidError
from ..report import page as report
from ..report.sections import sections
from .cache import Cache, key
from .diagnosed import Diagnosed, step_name
from .history import Changed, History, hashed
from .jobs import Job, Worker
from .residuals import compared
from .workspace import Workspace, workspace_page


class Session:
    """What the requests of a page do. Safe to use from several threads.

    Args:
        cache, turn: what several experiments share: the memory, and the lock of the one that works.
    """

    def __init__(self, path: Path, out: Path | None = None, *, cache: Cache | None = None, turn: threading.Lock | None = None):
        self.history, self.worker = History(path, out), Worker(turn)
        self._cache = cache or Cache()
        self._last: dict | None = None
        self._early: tuple[str, Workspace] | None = None  # of a fit that is yet to be diagnosed
        self._looks, self._looking = 0, False

    # ---- what stands

    def state(self) -> dict:
        """The hash of the file, the job, and what can be undone. Never raises for a bad experiment file."""
        self._looks += 1
        look, job = self._looks, self.worker.job
        try:
            sha, error = self.history.sync(), None
        except SysidError as problem:
            sha, error = None, str(problem)
        undo, redo = self.history.labels()
        found = {"name": self.history.name, "sha": sha, "error": error, "job": None if job is None else job.document(), "ready": sha is not None and self._find(sha) is not None, "fitted": self._fitted(sha), "undo": undo, "redo": redo}
        if look == self._looks:  # none that began later, after a change perhaps
            self._last = found
        return found

    def glance(self, beside: Callable[[Callable[[], None]], object]) -> dict | None:
        """The state as it was last seen, with the job as it is now; None where that is not good enough.

        While a job runs, every look at a file waits for the job to hand over, several times. So the page hears at once what
        was seen a moment ago, and `beside`, which runs a function in another thread, makes the next look.
        """
        job, last = self.worker.job, self._last
        if last is None or job is None or last["job"] is None or last["job"]["number"] != job.number:
            return None
        now = job.document()  # asked once: a job that ends in between would be done with nothing ready
        if now["state"] != "running":
            return None
        if not self._looking:
            self._looking = True
            beside(self._look)
        return {**last, "job": now, "fitted": self._fitted(last["sha"])}

    def _fitted(self, sha: str | None) -> bool:
        """Whether the fit under a text can be looked at while it is diagnosed."""
        return self._early is not None and self._early[0] == sha

    def _look(self) -> None:
        try:
            self.state()
        finally:
            self._looking = False

    def diagnosed(self, sha: str) -> Diagnosed:
        """What was found under the text with a hash. Raises SysidError where nothing is at hand."""
        found = self._find(sha)
        if found is None:
            raise SysidError("nothing was found under this text yet", do="reload")
        return found

    def page(self, sha: str) -> dict:
        """What was found as the page shows it, with the steps that led to it."""
        return self.diagnosed(sha).page(self.history.steps()) | self._steps(sha)

    def fitted(self, sha: str) -> dict:
        """What the page shows of a fit before it is diagnosed."""
        return workspace_page(self.workspace(sha), self._steps(sha))

    def workspace(self, sha: str) -> Workspace:
        """The fit under the text with a hash, ready to be looked at, diagnosed or not. Raises SysidError: there is none."""
        early, found = self._early, self._find(sha)
        if found is not None:
            return found.workspace
        if early is not None and early[0] == sha:
            return early[1]
        raise SysidError("nothing was found under this text yet", do="reload")

    def before(self, sha: str, step: int) -> Workspace | None:
        """The fit of an earlier step, None where it is not in memory. Raises SysidError: there is no such step."""
        steps = self.history.steps()
        if not 0 <= step < len(steps):
            raise SysidError("there is no such step", do="reload")
        found = self._find(steps[step].get("sha", ""))
        return None if found is None else found.workspace

    def _steps(self, sha: str) -> dict:
        """The steps that led to a text, itself the last, and which of them are in memory."""
        steps = self.history.steps()
        names = [step_name(s) for s in steps]
        if not steps or steps[-1].get("sha") != sha:
            names.append(self.history.named(sha) if names else "start")
        return {"steps": names, "kept": [k for k, s in enumerate(steps) if self._find(s.get("sha", "")) is not None]}

    # ---- work

    def run(self, seen: str | None = None) -> dict:
        """Fit and diagnose the file as it is, where that was not done yet."""
        sha = self.history.sync()
        if seen is not None and sha != seen:
            raise Changed("the experiment file changed", do="reload")
        self._ensure(sha)
        return self.state()

    def cancel(self) -> dict:
        """Ask the job to stop."""
        self.worker.cancel()
        return self.state()

    def add_finding(self, seen: str, number: int) -> dict:
        """Add a suspect to the model."""
        found = self.diagnosed(seen)
        if not 0 <= number < len(found.diagnosis.findings):
            raise SysidError("there is no such suspect", do="reload")
        finding = found.diagnosis.findings[number]
        return self._grow(seen, [spelled(finding.candidate, finding.joint)])

    def add_steps(self, seen: str) -> dict:
        """Add the steps that the diagnosis names, all of them in one change."""
        found = self.diagnosed(seen)
        named = [found.diagnosis.findings[k] for _, k in found.offered()]
        if not named:
            raise SysidError("the diagnosis names no step to add", do="reload")
        return self._grow(seen, [spelled(own.candidate, own.joint) for own in named], "*")

    def add_effect(self, seen: str, effect: str, joint: str | None) -> dict:
        """Add an effect of the vocabulary."""
        if effect not in vocabulary():
            raise SysidError("there is no such effect", allowed=", ".join(vocabulary()))
        return self._grow(seen, [(effect, None if joint is None or find(effect).scope == "robot" else [joint], {})])

    def add_formula(self, seen: str, formula: str, joint: str | None) -> dict:
        """Add a formula of the user's own."""
        if not formula.strip():
            raise SysidError("there is no formula", do="write one, such as a*sin(3*q)")
        return self._grow(seen, [("formula", None if joint is None else [joint], {"formula": formula.strip()})])

    def undo(self, seen: str) -> dict:
        """Restore the text before."""
        return self._moved(self.history.undo(seen))

    def redo(self, seen: str) -> dict:
        """Take an undo back."""
        return self._moved(self.history.redo(seen))

    def _grow(self, seen: str, parts: list[tuple[str, list[str] | None, dict]], where: str | None = None) -> dict:
        """Add effects, (word, joints, options) each, in one change of the text.

        Args:
            where: the joints as the step is called; by default those of the first.
        """
        # every joint, or the whole robot
        parts = [(effect, None if joints == ["*"] else joints, options) for effect, joints, options in parts]

        def make(text: str) -> str:
            for effect, joints, options in parts:
                text = loop.with_effect(text, effect, joints, options, str(self.history.path))
            return text

        words = ", ".join(effect if effect != "formula" else options["formula"] for effect, _, options in parts)
        where = where or ("*" if parts[0][1] is None else ", ".join(parts[0][1]))
        with loop.asked(self.history.path):
            return self._moved(self.history.change(seen, make, words, where))

    def _moved(self, sha: str) -> dict:
        self._ensure(sha)
        return self.state()

    def _ensure(self, sha: str) -> None:
        if self._find(sha) is not None:
            job = self.worker.job
            if job is not None and job.state == "running" and job.sha != sha:
                self.worker.cancel()  # of a text that does not stand any more
            return
        text = self.history.text()
        if hashed(text) == sha:
            self.worker.start(sha, lambda job: self._work(job, text))

    def _work(self, job: Job, text: str) -> None:
        experiment = self.history.experiment(text)
        state = key(hashed(text), experiment)
        fit = pipeline.fit(experiment, progress=job.tell)
        self._early = hashed(text), Workspace(fit)  # seen while the diagnosis is at work
        found = diagnose(experiment, fit=fit, progress=job.tell)
        job.tell("drawing", 0.0)
        view = Diagnosed(hashed(text), fit, found, self.history.run)
        view.residuals.warm(lambda share: job.tell("drawing", share))
        results.write(fit, self.history.run)
        results.write_json(self.history.run / "diagnosis.json", view.said)
        self.keep(state, text, view)
        self._early = None

    def keep(self, state: str, text: str, view: Diagnosed) -> None:
        """Remember what was found, and the errors under its text."""
        self._cache.keep(self.history.path, state, view)
        self.history.measured(text, view.fit.rms("test"), view.fit.rms("train"))

    def _find(self, sha: str) -> Diagnosed | None:
        return self._cache.find(self.history.path, sha)

    # ---- answers

    def compare(self, one: int, other: int) -> dict:
        """Two steps compared, with standard errors where both fits are in memory."""
        steps = self.history.steps()
        found = compared(steps, one, other)
        first, second = (self._find(steps[k].get("sha", "")) for k in (one, other))
        if first is not None and second is not None:
            errors = {d.joint: results.number(d.se) for d in comparison.compare(first.fit, second.fit, ("from", "to"))}
            for entry in found["joints"]:
                entry["se"] = errors.get(entry["joint"])
        return found

    def report(self, sha: str) -> str:
        """The report as `sysid report` writes it."""
        view = self.diagnosed(sha)
        return report.page(self.history.name, sections(view.fit, view.said, self.history.steps()))
