"""Work beside the first job, which changes nothing: previews, and designs of motions."""

from __future__ import annotations

from .. import effect_entry, experiment_file, pipeline
from ..errors import SysidError
from . import designs
from .cache import key
from .changes import Change
from .history import History, hashed
from .jobs import Job, Worker
from .previews import Preview, Previews
from .turn import Turn
from .workspace import Workspace


class Aside:
    """The second worker of an experiment, and what it made. Safe to use from several threads.

    Args:
        turn: to work, of all jobs.
    """

    def __init__(self, history: History, turn: Turn):
        self._history, self.worker, self.previews = history, Worker(turn, ahead=True), Previews()

    def document(self, sha: str | None) -> dict:
        """The job, and what there is for the text with a hash."""
        job = self.worker.job
        said = None if job is None else job.document()  # first: what it made when it was done is there
        made = [] if sha is None else self.previews.of(sha)
        return {
            "aside": said,
            "previews": [{"sha": one.sha, "words": one.words} for one in made],
            "designs": designs.listed(self._history.run),
        }

    def give_way(self, sha: str) -> None:
        """Stop what is at work for another text than that with a hash."""
        job = self.worker.job
        if job is not None and job.state == "running" and job.sha != sha:
            self.worker.cancel()  # nobody waits for what might have been

    def preview(self, seen: str, change: Change) -> str:
        """Fit a change of the text with the hash `seen`, without writing it; returns the hash of
        the new text. Raises SysidError: the change cannot be meant."""
        before = self._history.as_seen(seen).encode("utf-8")
        with effect_entry.asked(self._history.path):
            text = experiment_file.text(before)
            text = experiment_file.edited(before, change.make(text)).decode("utf-8")
            experiment = self._history.experiment(text)
            pipeline.build(experiment)
        sha, state = hashed(text), key(hashed(text), experiment)

        def work(job: Job) -> None:
            fit = pipeline.fit(experiment, progress=job.tell)
            self.previews.keep(Preview(seen, sha, change.words, state, Workspace(fit)))

        if self.previews.fit(sha, state) is None:
            self.worker.start(sha, work, f"preview of {change.words}", asks=False)
        return sha

    def design(self, seen: str, separate, duration) -> str:
        """Design a motion for the text with the hash `seen`; returns the name of its folder.

        Args:
            separate: as `designs.suspects` has it. duration: [s].
        """
        apart = designs.suspects(separate)
        if isinstance(duration, bool) or not isinstance(duration, int | float):
            raise SysidError("duration must be a number of seconds")
        experiment = self._history.experiment(self._history.as_seen(seen))

        def work(job: Job) -> None:
            designs.made(experiment, apart, float(duration), self._history.run, job.tell)

        words = " against ".join(e if j == "*" else f"{e} on {j}" for e, j in apart)
        said = "design of a motion that tells " + (f"{words} apart" if words else "most")
        self.worker.start(f"design {designs.named(apart)}", work, said)
        return designs.named(apart)
