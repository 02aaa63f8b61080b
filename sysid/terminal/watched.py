"""Progress on standard error: a bar where somebody watches, else a line now and then."""

import sys
import threading
import time
from contextlib import contextmanager, suppress

from rich.console import Console
from rich.markup import escape
from rich.text import Text

from .. import progress


@contextmanager
def progress_bar(course=None):
    """A bar with the stage and the time left; yields the function that pipelines call with (stage, share done)."""
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

    course = progress.Course() if course is None else course
    columns = (SpinnerColumn(), BarColumn(bar_width=20), TextColumn("{task.fields[left]}"), TextColumn("{task.description}"))
    begun = time.monotonic()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0, left="")

        def report(stage: str, share: float) -> None:
            if stage.startswith(progress.STAYS):
                bar.console.print(Text(f"sysid: {stage}"), soft_wrap=True)
                return
            words, whole = course.tell(stage, share)
            bar.update(task, completed=whole, description=escape(words), left=course.left(time.monotonic() - begun))

        yield report


_QUIET, _EVERY = 5.0, 15.0  # s before the first line of a log, and from line to line


@contextmanager
def progress_lines(course):
    """The same as lines for a log, the first after some seconds, then now and then, also where a stage tells nothing."""
    begun, lock, over = time.monotonic(), threading.Lock(), threading.Event()
    now = {"stage": "", "share": 0.0, "next": _QUIET}

    def say() -> None:
        elapsed = time.monotonic() - begun
        if not now["stage"] or elapsed < now["next"]:
            return
        now["next"] = elapsed + _EVERY
        told = course.left(elapsed) or f"{progress.spoken(elapsed)} so far"
        line(f"{now['stage']}, {100 * now['share']:.0f} %, {told}")

    def line(said: str) -> None:
        with suppress(OSError, ValueError):  # a log that nobody can write is no reason to stop
            print(f"sysid: {said}", file=sys.stderr, flush=True)

    def tick() -> None:
        while not over.wait(1.0):
            with lock:
                say()

    def report(stage: str, share: float) -> None:
        with lock:
            if stage.startswith(progress.STAYS):
                line(stage)
                return
            now["stage"], now["share"] = course.tell(stage, share)
            say()

    thread = threading.Thread(target=tick, name="sysid-progress", daemon=True)
    thread.start()
    try:
        yield report
    finally:
        over.set()
        thread.join()
