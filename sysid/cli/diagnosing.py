"""What the model lacks: diagnose, and its pages, report and studio."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Optional

import typer
import typer.core

from ..errors import SysidError
from .command_line import ExperimentPath, Json, Level, Out, Quiet, Trust, app, levels_of, progress_of


@app.command()
def diagnose(
    experiment: ExperimentPath,
    model: Annotated[Optional[Path], typer.Option("--model", help="A run folder: hold its fitted model, and ask what changed.")] = None,  # noqa: UP045
    log: Annotated[Optional[list[str]], typer.Option("--log", help="With --model: the new log.")] = None,  # noqa: UP045
    level: Level = None,
    trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Where the model fails and which effect is missing; with --model, what changed on a new log."""
    from .. import pipeline, results, whole_files

    spec = pipeline.load(experiment)
    if (model is None) != (not log):
        raise SysidError("--model and --log belong together", allowed="both, or neither", do="give the run folder and the new log")
    if model is not None:
        _changed(spec, model, log, levels_of(level), as_json, out, quiet)
        return
    if level:
        raise SysidError("--level goes with --model: a diagnosis asks all logs together", do="leave it out")
    from ..diagnose.diagnosis import diagnose as work
    from ..statement import kept

    run = whole_files.folder(out or Path("runs") / spec.name)
    before = results.notices(run)
    with progress_of(quiet or as_json, asks=True) as progress:
        found = work(spec, progress=progress)
    said = kept.written(spec, found, run)
    if as_json:
        print(json.dumps(said, allow_nan=False))
    elif not quiet:
        from ..terminal.diagnosis import show_diagnosis

        show_diagnosis(found, said, spec, before)
    if not found.fit.solution.converged:
        raise typer.Exit(1)


def _changed(spec, model: Path, logs: list[str], levels: dict[str, str], as_json: bool, out: Path | None, quiet: bool) -> None:
    from .. import whole_files
    from ..changes import changed
    from ..statement.changes import document

    run = whole_files.folder(out or Path("runs") / f"{spec.name}-changed")
    said = document(changed(spec, model, logs, levels), run)
    whole_files.write_json(run / "changed.json", said)
    if as_json:
        print(json.dumps(said, allow_nan=False))
    elif not quiet:
        from ..terminal.diagnosis import show_changed

        show_changed(said)


@app.command()
def report(
    experiment: ExperimentPath,
    opened: Annotated[bool, typer.Option("--open", help="Open the file in the browser.")] = False,
    trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Write one self-contained HTML file that opens anywhere, of the diagnosis that the run folder holds where nothing changed since, else of a new one."""
    from .. import loop, pipeline, whole_files
    from ..report import page
    from ..statement import kept

    spec = pipeline.load(experiment)
    run = whole_files.folder(out or Path("runs") / spec.name)
    with progress_of(quiet or as_json, asks=True) as progress:
        fit, said = kept.diagnosed(spec, run, progress=progress)
    path = page.write(fit, said, loop.read_history(run), run / "report.html")
    if as_json:
        print(json.dumps({"report": str(path), "bytes": path.stat().st_size, "verdict": said["verdict"], "diagnosed": said["made"], "run": str(run)}, allow_nan=False))
    elif not quiet:
        print(path)
        if not opened:
            from ..terminal.next_steps import next_step, out_of

            next_step("report", experiment, "--open", out=out_of(spec, run))
    if opened:
        import webbrowser

        webbrowser.open(path.resolve().as_uri())
    if not fit.solution.converged:
        raise typer.Exit(1)


@app.command()
def studio(
    experiment: ExperimentPath,
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="Port; 0 takes a free one.")] = 8765,
    host: Annotated[str, typer.Option("--host", help="Address to serve on. Any but this machine's own needs the token.")] = "127.0.0.1",
    token: Annotated[Optional[str], typer.Option("--token", help="What whoever opens the page must know (default: made up where --host is not this machine's own).")] = None,  # noqa: UP045
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Do not open the browser.")] = False,
    trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """The report's page alive in the browser: look, add, refit, undo. The experiment file stays the truth."""
    from .. import config, own_effects
    from ..studio.experiments import beside
    from ..studio.serve import serve
    from ..trusted import Untrusted

    def ready(address: str) -> None:
        if as_json:
            print(json.dumps({"studio": address}), flush=True)
        elif not quiet or (token is None and "?token=" in address):  # made up: nobody could know it
            print(f"{address}  (Ctrl-C stops it)", flush=True)
        if not (no_browser or as_json):
            import webbrowser

            webbrowser.open(address)

    for number, path in enumerate(beside(config.file_of(experiment))):
        try:
            spec = config.load(path)
            if trust:
                own_effects.allow(spec)
            elif number == 0:
                own_effects.demand(spec)
        except Untrusted:
            raise
        except SysidError:
            pass  # the page says what is wrong with it
    serve(experiment, out=out, host=host, port=port, token=token, ready=ready)
