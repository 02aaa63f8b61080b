"""Many robots or days: fleet."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Optional

import typer
import typer.core

from ..errors import SysidError
from .command_line import CORES, Json, Level, Out, Quiet, Trust, app, levels_of, progress_of


@app.command()
def fleet(
    experiments: Annotated[list[str], typer.Argument(metavar="EXPERIMENT...", help="Three or more experiments of one type of robot: files, folders, folders of folders, patterns. With --against: logs, files or patterns.")],
    against: Annotated[Optional[Path], typer.Option("--against", metavar="RUN", help="A run folder: hold its fitted model, and ask of each log what changed.")] = None,  # noqa: UP045
    level: Level = None,
    jobs: Annotated[int, typer.Option("--jobs", min=1, help="Processes, of --against.")] = CORES,
    workers: Annotated[int, typer.Option("--workers", min=1, help="Processes that share the experiments, on a Dask cluster of this machine.")] = 1,
    scheduler: Annotated[Optional[str], typer.Option("--scheduler", metavar="ADDRESS", help="A Dask scheduler whose workers share the experiments, tcp://HOST:PORT.")] = None,  # noqa: UP045
    rate: Annotated[float, typer.Option("--rate", help="Probability of any false alarm in the whole table, or in all logs.")] = 0.05,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of the fleets that are drawn to find the threshold.")] = 0,
    opened: Annotated[bool, typer.Option("--open", help="Open the page in the browser.")] = False,
    trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Many robots or many days: what they share, what differs, which one is odd and in what.

    With --against RUN: what changed on each of many logs, while the model of a run folder is held.
    """
    from .. import whole_files
    from ..terminal import fleets

    if not 0.0 < rate < 1.0:
        raise SysidError(f"--rate {rate:g}", allowed="a probability above 0, below 1")
    run = whole_files.folder(out or Path("runs") / "fleet")
    if against is not None:
        said, page = _against(against, experiments, levels_of(level), rate, jobs, run, quiet or as_json), None
    else:
        if level:
            raise SysidError("--level goes with --against: a fleet has all levels of each experiment", do="leave it out")
        said, page = _fleet(experiments, rate, seed, workers, scheduler, run, quiet or as_json)
    if as_json:
        print(json.dumps(said, allow_nan=False))
    elif not quiet:
        (fleets.show_fleet if page else fleets.show_against)(said)
        print(page or f"run folder: {said['run']}")
    if opened and page:
        import webbrowser

        webbrowser.open(page.resolve().as_uri())


def _fleet(experiments: list[str], rate: float, seed: int, workers: int, scheduler: str | None, run: Path, silent: bool) -> tuple[dict, Path]:
    from .. import fleet as fleets
    from .. import whole_files
    from ..report.fleet import write

    with progress_of(silent) as progress:
        found = fleets.fleet(experiments, rate=rate, seed=seed, workers=workers, scheduler=scheduler, progress=progress)
    said = fleets.document(found, run)
    whole_files.write_json(run / "fleet.json", said)
    return said, write(said, run / "fleet.html")


def _against(model: Path, logs: list[str], levels: dict[str, str], rate: float, jobs: int, run: Path, silent: bool) -> dict:
    from .. import whole_files
    from ..changes import many
    from ..statement.changes import many_document

    with progress_of(silent) as progress:
        tell = None if progress is None else lambda share: progress("asking the logs", share)
        found, failed = many(model, logs, levels, rate=rate, jobs=jobs, progress=tell)
    said = many_document(found, failed, model, run)
    whole_files.write_json(run / "against.json", said)
    return said
