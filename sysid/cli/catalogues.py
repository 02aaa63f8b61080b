"""What there is to have: export, effects, fetch."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Optional

import typer
import typer.core

from ..errors import SysidError
from .command_line import Json, Level, Out, Quiet, Trust, app, levels_of, progress_of


@app.command()
def export(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder of `sysid fit`.")],
    to: Annotated[str, typer.Option("--to", help="mjcf, sdf, drake or isaaclab.")],
    out: Annotated[Optional[Path], typer.Option("--out", help="The folder to write into (default RUN/<format>).")] = None,  # noqa: UP045
    level: Level = None,
    trust: Trust = False, as_json: Json = False, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Write the fitted model for a simulator, load it there again where that is installed, and tell what the format cannot say."""
    from .. import export as exporting

    found = exporting.export(run, to, out or run / to, levels=levels_of(level))
    said = exporting.document(found)
    if as_json:
        print(json.dumps(said, allow_nan=False))
    elif not quiet:
        from ..terminal.fitted import show_export

        show_export(found)
    if found.check.agrees is False:
        raise typer.Exit(1)


@app.command()
def effects(name: Annotated[Optional[str], typer.Argument(help="One effect; without it, all.")] = None, as_json: Json = False, out: Out = None, quiet: Quiet = False) -> None:  # noqa: UP045
    """The catalogue of physical effects: equation, parameters, units, what it looks like, what it is confused with."""
    from .. import whole_files
    from ..formula import DESCRIBED
    from ..vocabulary import describe, find, vocabulary

    found = [DESCRIBED] if name == "formula" else [describe(find(word)) for word in ([name] if name else vocabulary())]
    if out:
        whole_files.write_json(whole_files.folder(out) / "effects.json", {"effects": found})
    if as_json:
        print(json.dumps({"effects": found}))
    elif not quiet:
        from ..terminal.effects import show_effects

        show_effects(found)


@app.command()
def fetch(dataset: Annotated[Optional[str], typer.Argument(help="One data set; without it, all.")] = None, as_json: Json = False, out: Out = None, quiet: Quiet = False) -> None:  # noqa: UP045
    """Bring public logs into the data folder (SYSID_DATA_DIR), checked by SHA-256."""
    from ..datasets import DATASETS

    if dataset is not None and dataset not in DATASETS:
        raise SysidError(f"there is no data set {dataset!r}", allowed=", ".join(DATASETS))
    found = []
    for name in [dataset] if dataset else DATASETS:
        with progress_of(quiet or as_json, len(DATASETS[name].files)) as progress:
            files = DATASETS[name].fetch(into=out, progress=progress)
        found.append({"dataset": name, "licence": DATASETS[name].licence, "citation": DATASETS[name].citation, "files": [str(f) for f in files]})
        if not (quiet or as_json):
            print(f"{name}: {len(files)} files in {files[0].parent}\n  {DATASETS[name].citation}\n  licence: {DATASETS[name].licence}")
    if as_json:
        print(json.dumps({"datasets": found}))
