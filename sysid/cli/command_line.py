"""The command itself: its application, the options that commands share, and how they tell and finish."""

from __future__ import annotations

import gc
import json
import os
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Optional

import typer
import typer.core

from ..errors import SysidError
from ..free_memory import POLARS

CORES = os.cpu_count() or 1


# The matrices here are small: threads in the linear algebra cost more than they give, much more on a busy machine.
# It must be said before NumPy is loaded; a user's own setting wins.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault(*POLARS)

#: in the order of the work, each in a line that 80 columns hold
_SHORT = {
    "init": "Begin: an experiment from a robot and its logs.", "check": "What is wrong with the logs, before any fit.",
    "fit": "Identify links, rotors and friction.", "diagnose": "Which effect is missing, on which joint.",
    "add": "Add an effect; the error before and after.", "discover": "Diagnose and add until nothing is missing.",
    "report": "One HTML file with everything.", "studio": "The same page alive in the browser.", "history": "The steps and the error falling.",
    "compare": "Models against each other on held-out data.", "design": "The next motion to log.", "simulate": "Logs of a simulated robot, effects hidden.",
    "export": "The fitted model for a simulator.", "fleet": "Many robots or days: which one is odd.", "effects": "The catalogue of physical effects.",
    "fetch": "Public logs to try it on.", "study": "The paper's two studies.",
}  # fmt: skip


class _InOrder(typer.core.TyperGroup):
    """Commands in the order in which they are used, with lines that are never cut."""

    def list_commands(self, ctx):
        there = super().list_commands(ctx)
        return [*(name for name in _SHORT if name in there), *(name for name in there if name not in _SHORT)]

    def format_commands(self, ctx, formatter):
        with formatter.section("Commands"):
            formatter.write_dl([(name, _SHORT.get(name, "")) for name in self.list_commands(ctx)])


_HELP = "Identify what a robot is made of, and name the physics its model lacks. Begin with a folder that holds a URDF and logs: `sysid init FOLDER`; every command ends with the next one."
app = typer.Typer(cls=_InOrder, add_completion=False, invoke_without_command=True, pretty_exceptions_enable=False, rich_markup_mode=None, help=_HELP)
Json = Annotated[bool, typer.Option("--json", help="One JSON document on standard output, nothing else there.")]
Out = Annotated[Optional[Path], typer.Option("--out", help="Run folder (default runs/<experiment name>).")]  # noqa: UP045 - typer reads it
Quiet = Annotated[bool, typer.Option("--quiet", help="No progress, no table.")]
Level = Annotated[Optional[list[str]], typer.Option("--level", metavar="GROUP=LEVEL", help="Where effects are per group of logs: the level meant; again for another group.")]  # noqa: UP045
ExperimentPath = Annotated[Path, typer.Argument(metavar="EXPERIMENT", help="A YAML file, or a folder with config.yaml.")]


def _trust(given: bool) -> bool:
    TRUSTED["given"] = given
    return given


# whether this command was told --trust; a file that is not trusted is asked for where it would have run
TRUSTED = {"given": False}


Trust = Annotated[bool, typer.Option("--trust", callback=_trust, help="Let the Python files that the experiment names run; remembered for each as it is now.")]


def _version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        print(f"sysid {version('sysid')}")
        raise typer.Exit


@app.callback()
def _root(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and leave.")] = False,
) -> None:
    """Keeps `sysid fit` a command of its own however many there are."""
    if context.invoked_subcommand is None:
        raise SysidError("which command? `sysid init URDF LOG...` begins with a robot and its logs, `sysid check EXPERIMENT` looks at logs, `sysid fit EXPERIMENT` identifies, `sysid diagnose EXPERIMENT` names what is missing; `sysid --help` lists all in their order")


def levels_of(texts: list[str] | None) -> dict[str, str]:
    """{group: level} of --level options."""
    pairs = [text.partition("=") for text in texts or []]
    if wrong := [text for text, (group, _, level) in zip(texts or [], pairs) if not (group and level)]:
        raise SysidError(f"--level {wrong[0]!r}", allowed="GROUP=LEVEL, as in robot=r2")
    return {group: level for group, _, level in pairs}
Jobs = Annotated[int, typer.Option("--jobs", min=1, help="Processes.")]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Seed of everything random.")]


def silent(stage: str, share: float) -> None:
    """Progress that nobody watches."""


def one_of(value: str, option: str, allowed: tuple[str, ...]) -> str:
    """A value that is one of those allowed. Raises SysidError."""
    if value not in allowed:
        raise SysidError(f"{option} {value!r}", allowed=", ".join(allowed))
    return value


def finish(found: dict, as_json: bool, quiet: bool, show: str, run: Path) -> None:
    """What a study found, as JSON, as tables or not at all."""
    if as_json:
        print(json.dumps(found, allow_nan=False))
    elif not quiet:
        from ..terminal import studies

        getattr(studies, show)(found, run)


@contextmanager
def progress_of(silent: bool, fits: int = 1, *, asks: bool = False):
    """Progress on standard error, a bar where somebody watches, else a line now and then; nothing where silent.

    Args:
        fits, asks: what the command does, as far as is known; see `progress.Course`.
    """
    gc.freeze()  # what is imported stays: to look through it again and again is a twentieth of a diagnosis
    if silent or sys.stderr is None:
        yield None
        return
    from ..progress import Course
    from ..terminal.watched import progress_bar, progress_lines

    course = Course(fits, asks=asks)
    with progress_bar(course) if sys.stderr.isatty() else progress_lines(course) as report:
        yield report
