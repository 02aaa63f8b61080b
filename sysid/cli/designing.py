"""Motions to measure next: design."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Optional

import typer
import typer.core

from ..errors import SysidError
from .command_line import ExperimentPath, Json, Level, Quiet, Trust, app, levels_of, progress_of


@app.command()
def design(
    experiment: ExperimentPath,
    out: Annotated[Path, typer.Option("--out", help="The folder to write: trajectory.csv, trajectory.yaml, design.json.")],
    separate: Annotated[Optional[str], typer.Option("--separate", metavar="A:JOINT,B:JOINT", help="Suspects to tell apart, each effect:joint (* for the robot). By default those that the diagnosis in the run folder could not; none: the motion that tells most.")] = None,  # noqa: UP045
    duration: Annotated[float, typer.Option("--duration", help="Seconds of motion.")] = 20.0,
    limits: Annotated[Optional[Path], typer.Option("--limits", help="A YAML file of limits beside the URDF's: position, velocity, acceleration, jerk, torque by joint; margin, clearance, floor.")] = None,  # noqa: UP045
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of the starts.")] = 0,
    processes: Annotated[Optional[int], typer.Option("--processes", min=1, help="That share the starts; as many as there are cores. The motion is the same.")] = None,  # noqa: UP045
    level: Level = None, trust: Trust = False, as_json: Json = False, quiet: Quiet = False,
) -> None:  # fmt: skip
    """The next motion to log: the one that separates suspects, or the most informative within the limits."""
    from .. import design as designing
    from .. import pipeline, whole_files
    from ..statement import kept

    spec, folder = pipeline.load(experiment), whole_files.folder(out)
    if (folder / "config.yaml").is_file():
        raise SysidError("an experiment stands in this folder", where=str(folder), do="give the motion another with --out")
    suspects = None if separate is None else [] if separate == "none" else [_suspect(text) for text in separate.split(",")]
    last = kept.standing(spec, Path("runs") / spec.name)
    bounds = designing.read_limits(limits) if limits else None
    with progress_of(quiet or as_json, asks=True) as progress:
        found = designing.design(spec, duration=duration, separate=suspects, limits_spec=bounds, seed=seed, processes=processes, levels=levels_of(level), diagnosis=last, progress=progress)
    document = designing.write(found, folder)
    if as_json:
        print(json.dumps(document, allow_nan=False))
    elif not quiet:
        from ..terminal.designed import show_design

        show_design(document, spec)


def _suspect(text: str) -> tuple[str, str]:
    effect, colon, joint = text.strip().partition(":")
    if not (effect and colon and joint):
        raise SysidError(f"--separate {text!r}", allowed="effect:joint,effect:joint, as in stribeck:hip,presliding:hip")
    return effect, joint
