"""Long work on a thread of its own: one job at a time, with progress, and stopped where its progress is reported."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field

from ..errors import SysidError
from ..progress import Course
from .turn import Turn


class Cancelled(Exception):
    """The job was asked to stop."""


@dataclass
class Job:
    """One piece of work. state: running, done, failed or cancelled; share between 0 and 1; error: the line that says why."""

    number: int
    sha: str
    state: str = "running"
    stage: str = "waiting for its turn"
    share: float = 0.0
    error: str | None = None
    said: str = ""
    stop: threading.Event = field(default_factory=threading.Event)
    let_by: Callable[[], None] = lambda: None
    _course: Course = field(default_factory=lambda: Course(asks=True))

    def tell(self, stage: str, share: float) -> None:
        """Progress, as `pipeline.fit` and `diagnose` report it. Raises Cancelled."""
        if self.stop.is_set():
            raise Cancelled
        self.let_by()
        self.stage, self.share = self._course.tell(stage, share)

    def document(self) -> dict:
        """What the page polls."""
        return {"number": self.number, "sha": self.sha, "state": "cancelling" if self.state == "running" and self.stop.is_set() else self.state, "stage": self.stage, "share": self.share, "error": self.error, "said": self.said, "found": self._course.found}


class Worker:
    """Runs the newest job; one that it overtakes is stopped."""

    def __init__(self, turn: Turn | None = None, *, ahead: bool = False):
        """turn: held by the job that runs; shared by the workers of several experiments, of which one works at a time. ahead: its jobs are short, and
        do not wait for the end of a long one."""
        self._lock = threading.Lock()
        self._turn, self._ahead = turn or Turn(), ahead
        self.job: Job | None = None
        self._count = 0

    def start(self, sha: str, work: Callable[[Job], None], said: str = "", *, asks: bool = True) -> Job:
        """Begin a job on the text with a hash, unless it is the one that runs.

        Args:
            said: what it does, in words. asks: whether it questions a fit, as a diagnosis does (`progress.Course`).
        """
        with self._lock:
            if self.job is not None and self.job.state == "running" and not self.job.stop.is_set():
                if (self.job.sha, self.job.said) == (sha, said):
                    return self.job
                self.job.stop.set()
            self._count += 1
            self.job = job = Job(self._count, sha, said=said, _course=Course(asks=asks))
            threading.Thread(target=self._run, args=(job, work), name=f"sysid-job-{job.number}", daemon=True).start()
            return job

    def cancel(self) -> None:
        """Ask the job to stop."""
        with self._lock:
            if self.job is not None:
                self.job.stop.set()

    def _run(self, job: Job, work: Callable[[Job], None]) -> None:
        if not self._turn.take(job.stop, ahead=self._ahead):
            job.state = "cancelled"  # or overtaken, before its turn
            return
        if not self._ahead:
            job.let_by = self._turn.let_by
        try:
            try:
                job.tell("starting", 0.0)
                work(job)
                job.share, job.state = 1.0, "done"
            except Cancelled:
                job.state = "cancelled"
            except SysidError as error:
                job.error, job.state = str(error), "failed"
            except MemoryError:
                job.error, job.state = "out of memory", "failed"
            except Exception as error:  # a page must hear of a mistake of ours as well
                traceback.print_exc()
                job.error, job.state = f"internal error, {type(error).__name__}: {error}", "failed"
        finally:
            self._turn.give()
