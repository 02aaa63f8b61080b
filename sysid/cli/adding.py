"""What is missing is added: add, discover, history."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Optional

import typer
import typer.core

from ..errors import SysidError
from .command_line import ExperimentPath, Json, Out, Quiet, Trust, app, progress_of


@app.command()
def add(
    experiment: ExperimentPath,
    effect: Annotated[str, typer.Argument(help="A word of `sysid effects`, a class my_effects.py:Name, or formula.")],
    joint: Annotated[Optional[list[str]], typer.Option("--joint", help="The joint that has it; again for more. Default: every joint.")] = None,  # noqa: UP045
    option: Annotated[Optional[list[str]], typer.Option("--option", metavar="NAME=VALUE", help="An option of the effect, in YAML; again for more.")] = None,  # noqa: UP045
    per: Annotated[Optional[str], typer.Option("--per", metavar="GROUP", help="A group of logs (data.groups), at each level of which it has values of its own; takes the place of the same effect in all logs.")] = None,  # noqa: UP045
    spared: Annotated[Optional[list[str]], typer.Option("--except", metavar="LEVEL", help="With --per: a level that lacks it; again for more.")] = None,  # noqa: UP045
    force: Annotated[bool, typer.Option("--force", help="Add it also where the held-out error rises by more than its standard error.")] = False,
    trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Write an effect into the experiment file (comments kept), refit, and show the error before and after.

    Where the held-out error of its joint (over all joints for an effect of the whole robot) rises by more than its standard
    error nothing is written, and the status is 1.
    """
    from .. import effect_entry, loop, pipeline, results

    effect, joint = _on_joint(effect, joint)
    spec = pipeline.load(experiment)
    run = out or Path("runs") / spec.name
    before = results.notices(run)
    with progress_of(quiet or as_json, 3) as progress:
        own = {**effect_entry.options(option or []), **({"per": per} if per else {}), **({"except": list(spared)} if spared else {})}
        found = loop.add(experiment, effect, list(joint) if joint else None, own, force=force, progress=progress, out=out)
    said = loop.document(found)
    if as_json:
        print(json.dumps(said, allow_nan=False))
    elif not quiet:
        from ..terminal.steps import show_added

        show_added(said, spec, run, before)
    elif found.refused and not as_json:
        print(f"sysid: {found.says}", file=sys.stderr)
    if found.refused or not found.after.solution.converged:
        raise typer.Exit(1)


def _on_joint(effect: str, joints: list[str] | None) -> tuple[str, list[str] | None]:
    """stribeck:hip, as `--hide` and `--separate` have it, in two."""
    from ..vocabulary import vocabulary

    name, colon, joint = effect.partition(":")
    return (name, [joint]) if colon and joint and name in vocabulary() and not joints else (effect, joints)


@app.command()
def discover(
    experiment: ExperimentPath,
    most: Annotated[int, typer.Option("--max-steps", min=0, help="How many effects to add at most.")] = 10,
    trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Diagnose, add, refit, until nothing is missing; a step folder each. The experiment file stays as it is."""
    from .. import loop, pipeline, whole_files
    from ..terminal.steps import show_step

    spec = pipeline.load(experiment)
    run = whole_files.folder(out or Path("runs") / spec.name)
    said_each = None if as_json or quiet else show_step
    with progress_of(quiet or as_json, asks=True) as progress:
        found = loop.discover(spec, run, most=most, progress=progress, each=said_each)
    said = {"steps": found.steps, "verdict": found.said["verdict"], "refused": found.refused, "run": str(run)}
    if as_json:
        print(json.dumps(said, allow_nan=False))
    elif not quiet:
        from ..terminal.steps import show_discovery

        show_discovery({**said, "commands": found.commands}, found.diagnosis, found.said, spec)


@app.command()
def history(experiment: ExperimentPath, as_json: Json = False, out: Out = None, quiet: Quiet = False) -> None:
    """The steps of an experiment and the held-out error falling."""
    from .. import loop, pipeline

    spec = pipeline.load(experiment)
    run = out or Path("runs") / spec.name
    steps = loop.read_history(run)
    if not steps:
        raise SysidError("no step was made yet", where=str(run), do=f"run `sysid add {experiment} EFFECT` or `sysid discover {experiment}`")
    if as_json:
        print(json.dumps({"steps": steps}, allow_nan=False))
    elif not quiet:
        from ..terminal.steps import show_history

        show_history(steps, spec, run)
