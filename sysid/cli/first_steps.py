"""From a robot and its logs to a fit: init, check, fit, compare."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Optional

import typer
import typer.core

from ..errors import SysidError
from .command_line import ExperimentPath, Json, Out, Quiet, Trust, app, progress_of


@app.command()
def fit(
    experiment: ExperimentPath,
    workers: Annotated[int, typer.Option("--workers", min=1, help="Processes that share long logs, on a Dask cluster of this machine.")] = 1,
    scheduler: Annotated[Optional[str], typer.Option("--scheduler", metavar="ADDRESS", help="A Dask scheduler whose workers share long logs, tcp://HOST:PORT.")] = None,  # noqa: UP045
    trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Identify an experiment and write its run folder."""
    from .. import pipeline, results, whole_files

    spec = pipeline.load(experiment)
    run = whole_files.folder(out or Path("runs") / spec.name)
    with progress_of(quiet or as_json) as progress:
        found = pipeline.fit(spec, progress=progress, workers=workers, scheduler=scheduler)
    document = results.write(found, run)
    if as_json:
        print(json.dumps(document, allow_nan=False))
    elif not quiet:
        from ..terminal.fitted import show_fit

        show_fit(found, document)
    if not found.solution.converged:
        raise typer.Exit(1)


@app.command()
def init(
    robot: Annotated[str, typer.Argument(metavar="URDF", help="A URDF, xacro or MJCF file; or a folder that holds one and its logs.")],
    logs: Annotated[Optional[list[str]], typer.Argument(metavar="LOG...", help="Logs: files, folders, patterns.")] = None,  # noqa: UP045
    out: Annotated[Optional[Path], typer.Option("--out", help="The experiment folder to write (default: named as the URDF; the folder, where one was given alone).")] = None,  # noqa: UP045
    joints: Annotated[Optional[str], typer.Option("--joints", metavar="A,B,...", help="The joints that the columns are of, in their order.")] = None,  # noqa: UP045
    topic: Annotated[Optional[str], typer.Option("--topic", help="The topic of a bag, where several have joint states.")] = None,  # noqa: UP045
    rate: Annotated[Optional[float], typer.Option("--rate", metavar="HZ", help="Samples a second of logs without a clock.")] = None,  # noqa: UP045
    as_json: Json = False, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Look at a robot and its logs, and write an experiment that says what was guessed."""
    from .. import init as beginning

    if rate is not None and not 0.0 < rate < float("inf"):
        raise SysidError("--rate must be samples a second, above 0", where=f"--rate {rate:g}")
    wishes = beginning.Wishes(tuple(filter(None, (joints or "").split(","))), topic, rate)
    found, file = beginning.init(*beginning.sorted_out(robot, logs or [], out), wishes)
    if as_json:
        print(json.dumps(beginning.document(found, file), allow_nan=False))
    elif not quiet:
        from ..terminal.fitted import show_init

        show_init(found, file)


@app.command()
def check(experiment: ExperimentPath, trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False) -> None:
    """What is wrong with an experiment's logs, before any fit. Exit status 1 where a fit of them would be wrong."""
    from .. import check as doctor
    from .. import pipeline, whole_files

    spec = pipeline.load(experiment)
    document = doctor.document(doctor.check(spec))
    run = whole_files.folder(out or Path("runs") / spec.name)
    whole_files.write_json(run / "check.json", document)
    if as_json:
        print(json.dumps(document, allow_nan=False))
    elif not quiet:
        from ..terminal.fitted import show_check

        show_check(document, spec, run)
    if not document["ok"]:
        raise typer.Exit(1)


@app.command()
def compare(
    experiments: Annotated[list[Path], typer.Argument(metavar="EXPERIMENT...", help="One or more experiments with the same test logs; a run folder or a step's stands for its own.")],
    trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Model against measurement on held-out data, and models against each other with standard errors."""
    from .. import pipeline, whole_files
    from ..comparison import document

    # a run folder stands for the experiment that gives the same fit
    specs = [pipeline.load(path / "experiment.yaml" if (path / "fit.json").is_file() else path) for path in experiments]
    run = whole_files.folder(out or Path("runs") / "-".join(["compare", *(spec.name for spec in specs)]))
    with progress_of(quiet or as_json, len(specs)) as progress:
        fits = [pipeline.fit(spec, progress=progress) for spec in specs]
    names = [path.name if (path / "fit.json").is_file() else spec.name for path, spec in zip(experiments, specs)]
    found = document(fits, _told_apart(specs, names))
    whole_files.write_json(run / "compare.json", found)
    if as_json:
        print(json.dumps(found, allow_nan=False))
    elif not quiet:
        from ..terminal.fitted import show_comparison

        show_comparison(found, specs)
    if not all(found.solution.converged for found in fits):
        raise typer.Exit(1)


def _told_apart(specs, names: list[str]) -> list[str]:
    """Experiments' names, and those of run folders, with their folder where two share one, and a number where that does not help."""
    names = [f"{spec.folder.resolve().name}/{name}" if names.count(name) > 1 else name for spec, name in zip(specs, names)]
    return [f"{name} ({names[:k].count(name) + 1})" if names.count(name) > 1 else name for k, name in enumerate(names)]
