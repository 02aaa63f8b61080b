"""One experiment at work: its file, the jobs that run on it, and what was found under each of its
texts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from .. import comparison, effect_entry, fit_document, pipeline, results
from ..diagnose.diagnosis import diagnose
from ..errors import SysidError
from ..estimate import Fit
from ..report import page as report
from ..report.sections import sections
from ..statement import kept
from . import beside, changes
from .aside import Aside
from .cache import Cache, key
from .changes import Change
from .diagnosed import Diagnosed, offers
from .history import Changed, History, hashed
from .jobs import Job, Worker
from .rows import Shown
from .stretch import compared, stretch
from .turn import Turn
from .workspace import Workspace, workspace_page


class Session:
    """What the requests of a page do. Safe to use from several threads.

    Args:
        cache, turn: what several experiments share: the memory, and the turn to work.
    """

    def __init__(
        self,
        path: Path,
        out: Path | None = None,
        *,
        cache: Cache | None = None,
        turn: Turn | None = None,
    ):
        self.history, turn = History(path, out), turn or Turn()
        self.worker, self.aside = Worker(turn), Aside(self.history, turn)
        self._cache = cache or Cache()
        self._last: dict | None = None
        self._early: tuple[str, Workspace] | None = None  # of a fit that is yet to be diagnosed
        self._looks, self._looking = 0, False

    # ---- what stands

    def state(self) -> dict:
        """The hash of the file, the jobs, and what can be undone. Never raises for a bad file."""
        self._looks += 1
        look, job = self._looks, self.worker.job
        try:
            sha, error = self.history.sync(), None
        except SysidError as problem:
            sha, error = None, str(problem)
        undo, redo = self.history.labels()
        found = {
            "name": self.history.name, "sha": sha, "error": error,
            "job": None if job is None else job.document(),
            "ready": sha is not None and self._find(sha) is not None, "fitted": self._fitted(sha),
            "undo": undo, "redo": redo, **self.aside.document(sha),
        }  # fmt: skip
        if look == self._looks:  # none that began later, after a change perhaps
            self._last = found
        return found

    def glance(self, aside: Callable[[Callable[[], None]], object]) -> dict | None:
        """The state as it was last seen, with the job as it is now; None where that is not good
        enough.

        While a job runs, every look at a file waits for the job to hand over, several times. So
        the page hears at once what was seen a moment ago, and `aside`, which runs a function in
        another thread, makes the next look.
        """
        job, last = self.worker.job, self._last
        if last is None or job is None or last["job"] is None:
            return None
        if last["job"]["number"] != job.number:
            return None
        now = job.document()  # asked once: a job that ends in between would be done, nothing ready
        if now["state"] != "running":
            return None
        if not self._looking:
            self._looking = True
            aside(self._look)
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
        """What was found under the text with a hash. Raises SysidError: nothing is at hand."""
        found = self._find(sha)
        if found is None:
            raise SysidError("nothing was found under this text yet", do="reload")
        return found

    def page(self, sha: str) -> dict:
        """What was found as the page shows it, with the steps that led to it."""
        found = self.diagnosed(sha)
        return found.page(self.history.steps()) | self._steps(sha, found.fit)

    def fitted(self, sha: str) -> dict:
        """What the page shows of a fit before it is diagnosed."""
        seen = self.workspace(sha)
        return workspace_page(seen, self._steps(sha, seen.fit)) | offers()

    def workspace(self, sha: str, shown: str = "") -> Workspace:
        """The fit under the text with a hash, ready to be looked at, diagnosed or not.

        Args:
            shown: another one in its place, `step:2` or `preview:SHA`, as it is in memory.

        Raises:
            SysidError: there is none.
        """
        if shown:
            found = self.beside(sha, shown)
            if not isinstance(found, Workspace):
                raise SysidError("this can be laid over a fit, and is none itself", do="reload")
            return found
        early, found = self._early, self._find(sha)
        if found is not None:
            return found.workspace
        if early is not None and early[0] == sha:
            return early[1]
        raise SysidError("nothing was found under this text yet", do="reload")

    def beside(self, sha: str, which: str) -> Shown:
        """What can be laid over the fit of a text: `now`, `step:2`, `preview:SHA`, `run:NAME`.
        Raises SysidError: there is no such thing, or it is not in memory."""
        kind, _, name = which.partition(":")
        if which == "now":
            return self.workspace(sha)
        if kind == "preview":
            return self.aside.previews.find(name).workspace
        if kind == "run":
            return beside.run_named(self.history.run, self.workspace(sha).fit.joints, name)
        steps = self.history.steps()
        if kind != "step" or not name.isdecimal() or int(name) >= len(steps):
            raise SysidError("there is no such step", do="reload")
        found = self._find(steps[int(name)].get("sha", ""))
        if found is None:
            raise SysidError("this step is not in memory any more", do="undo to it, and redo")
        return found.workspace

    def _steps(self, sha: str, fit: Fit) -> dict:
        """The steps that led to a text, itself the last, and what can be laid beside it."""
        steps = self.history.steps()
        last = self.history.named(sha) if steps else "start"
        here = [k for k, s in enumerate(steps) if self._find(s.get("sha", "")) is not None]
        runs = [one.name for one in beside.runs(self.history.run, fit.joints)]
        return beside.led(steps, sha, last, fit) | {"kept": here, "runs": runs}

    # ---- work

    def run(self, seen: str | None = None) -> dict:
        """Fit and diagnose the file as it is, where that was not done yet."""
        sha = self.history.sync()
        if seen is not None and sha != seen:
            raise Changed("the experiment file changed", do="reload")
        self._ensure(sha)
        return self.state()

    def cancel(self) -> dict:
        """Ask the jobs to stop."""
        self.worker.cancel()
        self.aside.worker.cancel()
        return self.state()

    def add(self, seen: str, body: dict) -> dict:
        """Make the change that a request asks for (`changes.meant`)."""
        change = self._meant(seen, body)
        with effect_entry.asked(self.history.path):
            sha = self.history.change(seen, change.make, change.said, change.where)
        return self._moved(sha)

    def preview(self, seen: str, body: dict) -> dict:
        """Fit what a request would change, without writing it."""
        sha = self.aside.preview(seen, self._meant(seen, body))
        return self.state() | {"preview": sha}

    def design(self, seen: str, separate, duration) -> dict:
        """Design the next motion: the one that separates suspects, or that tells most."""
        name = self.aside.design(seen, separate, duration)
        return self.state() | {"design": name}

    def undo(self, seen: str) -> dict:
        """Restore the text before."""
        return self._moved(self.history.undo(seen))

    def redo(self, seen: str) -> dict:
        """Take an undo back."""
        return self._moved(self.history.redo(seen))

    def _meant(self, seen: str, body: dict) -> Change:
        found, shown = lambda: self.diagnosed(seen), lambda: self.workspace(seen)
        return changes.meant(body, found, shown, self.history.path)

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
            self.aside.give_way(sha)
            self.worker.start(sha, lambda job: self._work(job, text))

    def _work(self, job: Job, text: str) -> None:
        experiment, run = self.history.experiment(text), self.history.run
        state = key(hashed(text), experiment)
        fit = self.aside.previews.fit(hashed(text), state)
        fit = fit or pipeline.fit(experiment, progress=job.tell)
        early = Workspace(fit)
        early.told("test")  # what the first look asks for
        self._early = hashed(text), early  # seen while the diagnosis is at work
        said = kept.found(experiment, fit, run)
        if said is None:
            made = diagnose(experiment, fit=fit, progress=job.tell)
            said = kept.written(experiment, made, run)
        else:
            results.write(fit, run)
        job.tell("drawing", 0.0)
        self.keep(state, text, Diagnosed(hashed(text), fit, said))
        self._early = None

    def keep(self, state: str, text: str, found: Diagnosed) -> None:
        """Remember what was found, and the errors under its text."""
        self._cache.keep(self.history.path, state, found)
        self.history.measured(text, found.fit.rms("test"), found.fit.rms("train"))

    def _find(self, sha: str) -> Diagnosed | None:
        return self._cache.find(self.history.path, sha)

    # ---- answers

    def stretch(self, sha: str, part: str, low: float, high: float) -> dict:
        """What is missed between two times."""
        return stretch(self.workspace(sha), part, low, high, self.aside.previews.of(sha))

    def compare(self, one: int, other: int) -> dict:
        """Two steps compared, with standard errors where both fits are in memory."""
        steps = self.history.steps()
        found = compared(steps, one, other)
        first, second = (self._find(steps[k].get("sha", "")) for k in (one, other))
        if first is not None and second is not None:
            names = ("from", "to")
            errors = comparison.compare(first.fit, second.fit, names)
            errors = {d.joint: fit_document.number(d.se) for d in errors}
            for entry in found["joints"]:
                entry["se"] = errors.get(entry["joint"])
        return found

    def report(self, sha: str) -> str:
        """The report as `sysid report` writes it."""
        found = self.diagnosed(sha)
        made = sections(found.fit, found.said, self.history.steps())
        return report.page(self.history.name, made)
