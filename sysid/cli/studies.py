"""The paper's studies: study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer
import typer.core

from .command_line import CORES, ExperimentPath, Jobs, Json, Out, Quiet, Seed, Trust, finish, one_of, progress_of, silent

study = typer.Typer(no_args_is_help=True, help="The paper's two studies, and the choice of the prior's weight. Interrupted studies go on where they were.")


@study.command("bodies")
def study_bodies(
    count: Annotated[int, typer.Option("--bodies", min=1, help="How many random bodies.")] = 1000,
    seed: Seed = 0, jobs: Jobs = CORES,
    about: Annotated[str, typer.Option(help="Second moments of Table I: com | origin.")] = "com",
    wrench: Annotated[str, typer.Option(help='Applied wrench: "moment and force" | "force only".')] = "moment and force",
    jacobian: Annotated[str, typer.Option(help="analytic | differences.")] = "analytic",
    series: Annotated[int, typer.Option("--series", min=0, help="Terms of the exponential's power series; 0: the exact map.")] = 0,
    as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Section VI: random bodies, linear least squares and three parameterizations."""
    from .. import whole_files
    from ..studies.bodies import Reading
    from ..studies.commands import study_bodies as work

    reading = Reading(*(one_of(*choice) for choice in (
        (about, "--about", ("com", "origin")), (wrench, "--wrench", ("moment and force", "force only")),
        (jacobian, "--jacobian", ("analytic", "differences")),
    )), series=series)  # fmt: skip
    run = whole_files.folder(out or Path("runs") / "study-bodies")
    with progress_of(quiet or as_json) as progress:
        found = work(run, count=count, seed=seed, jobs=jobs, reading=reading, progress=progress or silent)
    finish(found, as_json, quiet, "show_bodies", run)


@study.command("restarts")
def study_restarts(
    experiment: ExperimentPath,
    count: Annotated[int, typer.Option("--restarts", min=1, help="How many random starts.")] = 20,
    seed: Seed = 0, jobs: Jobs = 1,
    inertia: Annotated[Optional[str], typer.Option(help="Another parameterization than the experiment's.")] = None,  # noqa: UP045
    newton_alone: Annotated[bool, typer.Option("--newton-alone", help="Newton in the parameterization's coordinates to the end, 3000 iterations at most.")] = False,
    trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Section VII: random starts of one experiment, each certified."""
    from .. import pipeline, whole_files
    from ..inertia import PARAMETERIZATIONS
    from ..studies.commands import study_restarts as work

    spec = pipeline.load(experiment)
    if inertia is not None:
        kind = one_of(inertia, "--inertia", tuple(PARAMETERIZATIONS))
        spec = spec.model_copy(update={"model": spec.model.model_copy(update={"inertia": kind})})
    if newton_alone:
        spec = spec.model_copy(update={"solver": spec.solver.model_copy(update={"handover": 0.0, "max_iterations": 3000})})
    run = whole_files.folder(out or Path("runs") / f"{spec.name}-restarts")
    with progress_of(quiet or as_json) as progress:
        found = work(spec, run, count=count, seed=seed, jobs=jobs, progress=progress or silent)
    finish(found, as_json, quiet, "show_restarts", run)
    if found["converged"] < found["restarts"]:
        raise typer.Exit(1)


@study.command("prior")
def study_prior(experiment: ExperimentPath, jobs: Jobs = 1, trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False) -> None:
    """The prior's weight by cross-validation within the training logs."""
    from .. import pipeline, whole_files
    from ..studies.commands import study_prior as work

    spec = pipeline.load(experiment)
    run = whole_files.folder(out or Path("runs") / f"{spec.name}-prior")
    with progress_of(quiet or as_json) as progress:
        found = work(spec, run, jobs=jobs, progress=progress or silent)
    finish(found, as_json, quiet, "show_prior", run)
