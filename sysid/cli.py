"""The commands: they parse, call, print. Nothing is computed here."""

from __future__ import annotations

import json
import os
import sys
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Optional

import typer
import typer.core

from .errors import SysidError

# The matrices here are small: threads in the linear algebra cost more than they give, much more on a busy machine.
# It must be said before NumPy is loaded; a user's own setting wins.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

_CORES = os.cpu_count() or 1
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
    _TRUST["given"] = given
    return given


# whether this command was told --trust; a file that is not trusted is asked for where it would have run
_TRUST = {"given": False}
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


@app.command()
def fit(
    experiment: ExperimentPath,
    workers: Annotated[int, typer.Option("--workers", min=1, help="Processes that share long logs, on a Dask cluster of this machine.")] = 1,
    scheduler: Annotated[Optional[str], typer.Option("--scheduler", metavar="ADDRESS", help="A Dask scheduler whose workers share long logs, tcp://HOST:PORT.")] = None,  # noqa: UP045
    trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Identify an experiment and write its run folder."""
    from . import pipeline, results, whole_files

    spec = pipeline.load(experiment)
    run = whole_files.folder(out or Path("runs") / spec.name)
    with _progress(quiet or as_json) as progress:
        found = pipeline.fit(spec, progress=progress, workers=workers, scheduler=scheduler)
    document = results.write(found, run)
    if as_json:
        print(json.dumps(document, allow_nan=False))
    elif not quiet:
        from .terminal import show_fit

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
    from . import init as beginning

    if rate is not None and not 0.0 < rate < float("inf"):
        raise SysidError("--rate must be samples a second, above 0", where=f"--rate {rate:g}")
    wishes = beginning.Wishes(tuple(filter(None, (joints or "").split(","))), topic, rate)
    found, file = beginning.init(*beginning.sorted_out(robot, logs or [], out), wishes)
    if as_json:
        print(json.dumps(beginning.document(found, file), allow_nan=False))
    elif not quiet:
        from .terminal import show_init

        show_init(found, file)


@app.command()
def check(experiment: ExperimentPath, trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False) -> None:
    """What is wrong with an experiment's logs, before any fit. Exit status 1 where a fit of them would be wrong."""
    from . import check as doctor
    from . import pipeline, whole_files

    spec = pipeline.load(experiment)
    document = doctor.document(doctor.check(spec))
    whole_files.write_json(whole_files.folder(out or Path("runs") / spec.name) / "check.json", document)
    if as_json:
        print(json.dumps(document, allow_nan=False))
    elif not quiet:
        from .terminal import show_check

        show_check(document, spec)
    if not document["ok"]:
        raise typer.Exit(1)


@app.command()
def design(
    experiment: ExperimentPath,
    out: Annotated[Path, typer.Option("--out", help="The folder to write: trajectory.csv, trajectory.yaml, design.json.")],
    separate: Annotated[Optional[str], typer.Option("--separate", metavar="A:JOINT,B:JOINT", help="Suspects to tell apart, each effect:joint (* for the robot).")] = None,  # noqa: UP045
    duration: Annotated[float, typer.Option("--duration", help="Seconds of motion.")] = 20.0,
    limits: Annotated[Optional[Path], typer.Option("--limits", help="A YAML file of limits beside the URDF's: position, velocity, acceleration, jerk, torque by joint; margin, clearance, floor.")] = None,  # noqa: UP045
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of the starts.")] = 0,
    processes: Annotated[Optional[int], typer.Option("--processes", min=1, help="That share the starts; as many as there are cores. The motion is the same.")] = None,  # noqa: UP045
    level: Level = None, trust: Trust = False, as_json: Json = False, quiet: Quiet = False,
) -> None:  # fmt: skip
    """The next motion to log: the most informative within the limits, or the one that separates suspects."""
    from . import design as designing
    from . import pipeline, whole_files

    spec, folder = pipeline.load(experiment), whole_files.folder(out)
    suspects = [_suspect(text) for text in separate.split(",")] if separate else []
    bounds = designing.read_limits(limits) if limits else None
    with _progress(quiet or as_json, asks=True) as progress:
        found = designing.design(spec, duration=duration, separate=suspects, limits_spec=bounds, seed=seed, processes=processes, levels=_levels(level), progress=progress)
    document = designing.write(found, folder)
    if as_json:
        print(json.dumps(document, allow_nan=False))
    elif not quiet:
        from .terminal import show_design

        show_design(document)


def _suspect(text: str) -> tuple[str, str]:
    effect, colon, joint = text.strip().partition(":")
    if not (effect and colon and joint):
        raise SysidError(f"--separate {text!r}", allowed="effect:joint,effect:joint, as in stribeck:hip,presliding:hip")
    return effect, joint


@app.command()
def compare(
    experiments: Annotated[list[Path], typer.Argument(metavar="EXPERIMENT...", help="One or more experiments with the same test logs; a run folder or a step's stands for its own.")],
    trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Model against measurement on held-out data, and models against each other with standard errors."""
    from . import pipeline, whole_files
    from .comparison import document

    # a run folder stands for the experiment that gives the same fit
    specs = [pipeline.load(path / "experiment.yaml" if (path / "fit.json").is_file() else path) for path in experiments]
    run = whole_files.folder(out or Path("runs") / "-".join(["compare", *(spec.name for spec in specs)]))
    with _progress(quiet or as_json, len(specs)) as progress:
        fits = [pipeline.fit(spec, progress=progress) for spec in specs]
    names = [path.name if (path / "fit.json").is_file() else spec.name for path, spec in zip(experiments, specs)]
    found = document(fits, _told_apart(specs, names))
    whole_files.write_json(run / "compare.json", found)
    if as_json:
        print(json.dumps(found, allow_nan=False))
    elif not quiet:
        from .terminal import show_comparison

        show_comparison(found, specs)
    if not all(found.solution.converged for found in fits):
        raise typer.Exit(1)


@app.command()
def fleet(
    experiments: Annotated[list[str], typer.Argument(metavar="EXPERIMENT...", help="Three or more experiments of one type of robot: files, folders, folders of folders, patterns. With --against: logs, files or patterns.")],
    against: Annotated[Optional[Path], typer.Option("--against", metavar="RUN", help="A run folder: hold its fitted model, and ask of each log what changed.")] = None,  # noqa: UP045
    level: Level = None,
    jobs: Annotated[int, typer.Option("--jobs", min=1, help="Processes, of --against.")] = _CORES,
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
    from . import terminal, whole_files

    if not 0.0 < rate < 1.0:
        raise SysidError(f"--rate {rate:g}", allowed="a probability above 0, below 1")
    run = whole_files.folder(out or Path("runs") / "fleet")
    if against is not None:
        said, page = _against(against, experiments, _levels(level), rate, jobs, run, quiet or as_json), None
    else:
        if level:
            raise SysidError("--level goes with --against: a fleet has all levels of each experiment", do="leave it out")
        said, page = _fleet(experiments, rate, seed, workers, scheduler, run, quiet or as_json)
    if as_json:
        print(json.dumps(said, allow_nan=False))
    elif not quiet:
        (terminal.show_fleet if page else terminal.show_against)(said)
        print(page or f"run folder: {said['run']}")
    if opened and page:
        import webbrowser

        webbrowser.open(page.resolve().as_uri())


def _fleet(experiments: list[str], rate: float, seed: int, workers: int, scheduler: str | None, run: Path, silent: bool) -> tuple[dict, Path]:
    from . import fleet as fleets
    from . import whole_files
    from .report.fleet import write

    with _progress(silent) as progress:
        found = fleets.fleet(experiments, rate=rate, seed=seed, workers=workers, scheduler=scheduler, progress=progress)
    said = fleets.document(found, run)
    whole_files.write_json(run / "fleet.json", said)
    return said, write(said, run / "fleet.html")


def _against(model: Path, logs: list[str], levels: dict[str, str], rate: float, jobs: int, run: Path, silent: bool) -> dict:
    from . import whole_files
    from .changes import many
    from .statement.changes import many_document

    with _progress(silent) as progress:
        tell = None if progress is None else lambda share: progress("asking the logs", share)
        found, failed = many(model, logs, levels, rate=rate, jobs=jobs, progress=tell)
    said = many_document(found, failed, model, run)
    whole_files.write_json(run / "against.json", said)
    return said


@app.command()
def simulate(
    experiment: ExperimentPath,
    out: Annotated[Path, typer.Option("--out", help="The folder to write: config.yaml, robot.urdf, train.csv, test.csv, truth.json.")],
    hide: Annotated[Optional[list[str]], typer.Option("--hide", metavar="EFFECT:JOINT[:name=value,...]", help="An effect that config.yaml does not list; may be given again. Values left out are drawn; size=2 doubles them. torque_saturation takes reports=command: the log holds what was asked for, the limit acts.")] = None,  # noqa: UP045
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of everything random.")] = 0,
    duration: Annotated[float, typer.Option("--duration", help="Seconds of each log.")] = 20.0,
    rate: Annotated[float, typer.Option("--rate", help="Samples a second.")] = 1000.0,
    noise: Annotated[Optional[float], typer.Option("--noise", help="Standard deviation of the torque noise [N m] (default 1 to 2 % of each joint's torque).")] = None,  # noqa: UP045
    colour: Annotated[Optional[float], typer.Option("--colour", help="Time constant [s] of half of the noise's variance (default white).")] = None,  # noqa: UP045
    encoder: Annotated[Optional[int], typer.Option("--encoder", help="Bits a turn of the motor, of the joint where it has no rotor; 0: exact (default 14 on the motor).")] = None,  # noqa: UP045
    speed: Annotated[Optional[float], typer.Option("--speed", help="Top speed [rad/s] (default by the robot's size).")] = None,  # noqa: UP045
    motion: Annotated[str, typer.Option("--motion", help="exciting, moves (from point to point, with stops), or sines (one slow sine a joint).")] = "exciting",
    logs: Annotated[int, typer.Option("--logs", help="Training logs: train_1.csv, train_2.csv, ..., each of --duration.")] = 1,
    knocks: Annotated[int, typer.Option("--knocks", help="Knocks on the arm in each log.")] = 0,
    spikes: Annotated[float, typer.Option("--spikes", help="Wrong samples in the torque, a second and joint.")] = 0.0,
    brakes: Annotated[bool, typer.Option("--brakes", help="A joint that rests is braked: its torque reads 0, its angle is frozen (with --motion moves).")] = False,
    jitter: Annotated[float, typer.Option("--jitter", help="Milliseconds (standard deviation) that samples come early or late; a slow logger: --rate 100 --jitter 2.")] = 0.0,
    trajectory: Annotated[Optional[Path], typer.Option("--trajectory", help="A motion for the training log to play, trajectory.csv of `sysid design`; the same seed and --duration make the same robot.")] = None,  # noqa: UP045
    current: Annotated[Optional[str], typer.Option("--current", metavar="STEP", help="Step of the logged torque [N m], or a share of each joint's peak, as in 2%.")] = None,  # noqa: UP045
    force: Annotated[bool, typer.Option("--force", help="Write over a simulation whose files were changed since.")] = False,
    as_json: Json = False, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Simulate an experiment's robot in closed loop, with hidden effects, and write logs to identify."""
    from . import simulate as simulation

    hidden = [simulation.hidden(text) for text in hide or []]
    folder = simulation.prepare(out, force=force)
    spec, robot, notices = simulation.load(experiment)
    with _progress(quiet or as_json, logs + 1) as progress:
        found = simulation.simulate(
            robot, hide=hidden, seed=seed, duration=duration, rate=rate, noise=noise, colour=colour, encoder=encoder, speed=speed, progress=progress,
            motion=motion, logs=logs, knocks=knocks, spikes=spikes, brakes=brakes, jitter=jitter, current=current,
            trajectory=None if trajectory is None else simulation.read_trajectory(trajectory, robot.joints),
        )  # fmt: skip
    truth = simulation.write(found, spec, folder, force=force)
    if as_json:
        print(json.dumps(truth, allow_nan=False))
    elif not quiet:
        for part, log in found.truth["logs"].items():
            print(f"{part}: {log['samples']} samples; noise " + ", ".join(f"{joint} {rms:.3g}" for joint, rms in log["noise_rms"].items()))
            kinds = [event["kind"] for event in log["events"]]
            if kinds:
                print("  " + ", ".join(f"{kinds.count(kind)} {kind}{'s' if kinds.count(kind) > 1 else ''}" for kind in dict.fromkeys(kinds)))
        for entry in found.truth["hidden"]:
            print(f"hidden: {entry['effect']} on {entry['joint']}, " + ", ".join(f"{n}={v:.4g}" if isinstance(v, float) else f"{n}={v}" for n, v in entry["values"].items()))
        for notice in notices:
            print(f"note {notice}")
        print(f"folder: {folder}")
        from .terminal import next_step

        next_step("diagnose", folder)


@app.command()
def diagnose(
    experiment: ExperimentPath,
    model: Annotated[Optional[Path], typer.Option("--model", help="A run folder: hold its fitted model, and ask what changed.")] = None,  # noqa: UP045
    log: Annotated[Optional[list[str]], typer.Option("--log", help="With --model: the new log.")] = None,  # noqa: UP045
    level: Level = None,
    trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Where the model fails and which effect is missing; with --model, what changed on a new log."""
    from . import pipeline, whole_files

    spec = pipeline.load(experiment)
    if (model is None) != (not log):
        raise SysidError("--model and --log belong together", allowed="both, or neither", do="give the run folder and the new log")
    if model is not None:
        _changed(spec, model, log, _levels(level), as_json, out, quiet)
        return
    if level:
        raise SysidError("--level goes with --model: a diagnosis asks all logs together", do="leave it out")
    from .diagnose.diagnosis import diagnose as work
    from .statement import kept

    run = whole_files.folder(out or Path("runs") / spec.name)
    with _progress(quiet or as_json, asks=True) as progress:
        found = work(spec, progress=progress)
    said = kept.written(spec, found, run)
    if as_json:
        print(json.dumps(said, allow_nan=False))
    elif not quiet:
        from .terminal import show_diagnosis

        show_diagnosis(found, said, spec)
    if not found.fit.solution.converged:
        raise typer.Exit(1)


def _levels(texts: list[str] | None) -> dict[str, str]:
    """{group: level} of --level options."""
    pairs = [text.partition("=") for text in texts or []]
    if wrong := [text for text, (group, _, level) in zip(texts or [], pairs) if not (group and level)]:
        raise SysidError(f"--level {wrong[0]!r}", allowed="GROUP=LEVEL, as in robot=r2")
    return {group: level for group, _, level in pairs}


def _changed(spec, model: Path, logs: list[str], levels: dict[str, str], as_json: bool, out: Path | None, quiet: bool) -> None:
    from . import whole_files
    from .changes import changed
    from .statement.changes import document

    run = whole_files.folder(out or Path("runs") / f"{spec.name}-changed")
    said = document(changed(spec, model, logs, levels), run)
    whole_files.write_json(run / "changed.json", said)
    if as_json:
        print(json.dumps(said, allow_nan=False))
    elif not quiet:
        from .terminal import show_changed

        show_changed(said)


@app.command()
def report(
    experiment: ExperimentPath,
    opened: Annotated[bool, typer.Option("--open", help="Open the file in the browser.")] = False,
    trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Write one self-contained HTML file that opens anywhere, of the diagnosis that the run folder holds where nothing changed since, else of a new one."""
    from . import loop, pipeline, whole_files
    from .report import page
    from .statement import kept

    spec = pipeline.load(experiment)
    run = whole_files.folder(out or Path("runs") / spec.name)
    with _progress(quiet or as_json, asks=True) as progress:
        fit, said = kept.diagnosed(spec, run, progress=progress)
    path = page.write(fit, said, loop.read_history(run), run / "report.html")
    if as_json:
        print(json.dumps({"report": str(path), "bytes": path.stat().st_size, "verdict": said["verdict"], "diagnosed": said["made"], "run": str(run)}, allow_nan=False))
    elif not quiet:
        print(path)
        if not opened:
            from .terminal import next_step

            next_step("report", experiment, "--open")
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
    from . import config, own_effects
    from .studio.experiments import beside
    from .studio.serve import serve
    from .trusted import Untrusted

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
    from . import loop

    effect, joint = _on_joint(effect, joint)
    with _progress(quiet or as_json, 3) as progress:
        own = {**loop.options(option or []), **({"per": per} if per else {}), **({"except": list(spared)} if spared else {})}
        found = loop.add(experiment, effect, list(joint) if joint else None, own, force=force, progress=progress, out=out)
    said = loop.document(found)
    if as_json:
        print(json.dumps(said, allow_nan=False))
    elif not quiet:
        from .terminal import show_added

        show_added(said)
    elif found.refused and not as_json:
        print(f"sysid: {found.says}", file=sys.stderr)
    if found.refused or not found.after.solution.converged:
        raise typer.Exit(1)


def _on_joint(effect: str, joints: list[str] | None) -> tuple[str, list[str] | None]:
    """stribeck:hip, as `--hide` and `--separate` have it, in two."""
    from .vocabulary import vocabulary

    name, colon, joint = effect.partition(":")
    return (name, [joint]) if colon and joint and name in vocabulary() and not joints else (effect, joints)


@app.command()
def discover(
    experiment: ExperimentPath,
    most: Annotated[int, typer.Option("--max-steps", min=0, help="How many effects to add at most.")] = 10,
    trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Diagnose, add, refit, until nothing is missing; a step folder each. The experiment file stays as it is."""
    from . import loop, pipeline, whole_files
    from .terminal import show_step

    spec = pipeline.load(experiment)
    run = whole_files.folder(out or Path("runs") / spec.name)
    said_each = None if as_json or quiet else show_step
    with _progress(quiet or as_json, asks=True) as progress:
        found = loop.discover(spec, run, most=most, progress=progress, each=said_each)
    said = {"steps": found.steps, "verdict": found.said["verdict"], "refused": found.refused, "run": str(run)}
    if as_json:
        print(json.dumps(said, allow_nan=False))
    elif not quiet:
        from .terminal import show_discovery

        show_discovery({**said, "commands": found.commands}, found.diagnosis, found.said, spec)


@app.command()
def history(experiment: ExperimentPath, as_json: Json = False, out: Out = None, quiet: Quiet = False) -> None:
    """The steps of an experiment and the held-out error falling."""
    from . import loop, pipeline

    spec = pipeline.load(experiment)
    run = out or Path("runs") / spec.name
    steps = loop.read_history(run)
    if not steps:
        raise SysidError("no step was made yet", where=str(run), do=f"run `sysid add {experiment} EFFECT` or `sysid discover {experiment}`")
    if as_json:
        print(json.dumps({"steps": steps}, allow_nan=False))
    elif not quiet:
        from .terminal import show_history

        show_history(steps, spec)


@app.command()
def export(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder of `sysid fit`.")],
    to: Annotated[str, typer.Option("--to", help="mjcf, sdf, drake or isaaclab.")],
    out: Annotated[Optional[Path], typer.Option("--out", help="The folder to write into (default RUN/<format>).")] = None,  # noqa: UP045
    level: Level = None,
    trust: Trust = False, as_json: Json = False, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Write the fitted model for a simulator, load it there again where that is installed, and tell what the format cannot say."""
    from . import export as exporting

    found = exporting.export(run, to, out or run / to, levels=_levels(level))
    said = exporting.document(found)
    if as_json:
        print(json.dumps(said, allow_nan=False))
    elif not quiet:
        from .terminal import show_export

        show_export(found)
    if found.check.agrees is False:
        raise typer.Exit(1)


@app.command()
def effects(name: Annotated[Optional[str], typer.Argument(help="One effect; without it, all.")] = None, as_json: Json = False, out: Out = None, quiet: Quiet = False) -> None:  # noqa: UP045
    """The catalogue of physical effects: equation, parameters, units, what it looks like, what it is confused with."""
    from . import whole_files
    from .vocabulary import describe, find, vocabulary

    found = [describe(find(word)) for word in ([name] if name else vocabulary())]
    if out:

        whole_files.write_json(whole_files.folder(out) / "effects.json", {"effects": found})
    if as_json:
        print(json.dumps({"effects": found}))
    elif not quiet:
        from .terminal import show_effects

        show_effects(found)


@app.command()
def fetch(dataset: Annotated[Optional[str], typer.Argument(help="One data set; without it, all.")] = None, as_json: Json = False, out: Out = None, quiet: Quiet = False) -> None:  # noqa: UP045
    """Bring public logs into the data folder (SYSID_DATA_DIR), checked by SHA-256."""
    from .datasets import DATASETS

    if dataset is not None and dataset not in DATASETS:
        raise SysidError(f"there is no data set {dataset!r}", allowed=", ".join(DATASETS))
    found = []
    for name in [dataset] if dataset else DATASETS:
        with _progress(quiet or as_json, len(DATASETS[name].files)) as progress:
            files = DATASETS[name].fetch(into=out, progress=progress)
        found.append({"dataset": name, "licence": DATASETS[name].licence, "citation": DATASETS[name].citation, "files": [str(f) for f in files]})
        if not (quiet or as_json):
            print(f"{name}: {len(files)} files in {files[0].parent}\n  {DATASETS[name].citation}\n  licence: {DATASETS[name].licence}")
    if as_json:
        print(json.dumps({"datasets": found}))


study = typer.Typer(no_args_is_help=True, help="The paper's two studies, and the choice of the prior's weight. Interrupted studies go on where they were.")
app.add_typer(study, name="study")
Jobs = Annotated[int, typer.Option("--jobs", min=1, help="Processes.")]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Seed of everything random.")]


@study.command("bodies")
def study_bodies(
    count: Annotated[int, typer.Option("--bodies", min=1, help="How many random bodies.")] = 1000,
    seed: Seed = 0, jobs: Jobs = _CORES,
    about: Annotated[str, typer.Option(help="Second moments of Table I: com | origin.")] = "com",
    wrench: Annotated[str, typer.Option(help='Applied wrench: "moment and force" | "force only".')] = "moment and force",
    jacobian: Annotated[str, typer.Option(help="analytic | differences.")] = "analytic",
    series: Annotated[int, typer.Option("--series", min=0, help="Terms of the exponential's power series; 0: the exact map.")] = 0,
    as_json: Json = False, out: Out = None, quiet: Quiet = False,
) -> None:  # fmt: skip
    """Section VI: random bodies, linear least squares and three parameterizations."""
    from . import whole_files
    from .studies.bodies import Reading
    from .studies.commands import study_bodies as work

    reading = Reading(*(_one_of(*choice) for choice in (
        (about, "--about", ("com", "origin")), (wrench, "--wrench", ("moment and force", "force only")),
        (jacobian, "--jacobian", ("analytic", "differences")),
    )), series=series)  # fmt: skip
    run = whole_files.folder(out or Path("runs") / "study-bodies")
    with _progress(quiet or as_json) as progress:
        found = work(run, count=count, seed=seed, jobs=jobs, reading=reading, progress=progress or _silent)
    _finish(found, as_json, quiet, "show_bodies", run)


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
    from . import pipeline, whole_files
    from .inertia import PARAMETERIZATIONS
    from .studies.commands import study_restarts as work

    spec = pipeline.load(experiment)
    if inertia is not None:
        kind = _one_of(inertia, "--inertia", tuple(PARAMETERIZATIONS))
        spec = spec.model_copy(update={"model": spec.model.model_copy(update={"inertia": kind})})
    if newton_alone:
        spec = spec.model_copy(update={"solver": spec.solver.model_copy(update={"handover": 0.0, "max_iterations": 3000})})
    run = whole_files.folder(out or Path("runs") / f"{spec.name}-restarts")
    with _progress(quiet or as_json) as progress:
        found = work(spec, run, count=count, seed=seed, jobs=jobs, progress=progress or _silent)
    _finish(found, as_json, quiet, "show_restarts", run)
    if found["converged"] < found["restarts"]:
        raise typer.Exit(1)


@study.command("prior")
def study_prior(experiment: ExperimentPath, jobs: Jobs = 1, trust: Trust = False, as_json: Json = False, out: Out = None, quiet: Quiet = False) -> None:
    """The prior's weight by cross-validation within the training logs."""
    from . import pipeline, whole_files
    from .studies.commands import study_prior as work

    spec = pipeline.load(experiment)
    run = whole_files.folder(out or Path("runs") / f"{spec.name}-prior")
    with _progress(quiet or as_json) as progress:
        found = work(spec, run, jobs=jobs, progress=progress or _silent)
    _finish(found, as_json, quiet, "show_prior", run)


def _told_apart(specs, names: list[str]) -> list[str]:
    """Experiments' names, and those of run folders, with their folder where two share one, and a number where that does not help."""
    names = [f"{spec.folder.resolve().name}/{name}" if names.count(name) > 1 else name for spec, name in zip(specs, names)]
    return [f"{name} ({names[:k].count(name) + 1})" if names.count(name) > 1 else name for k, name in enumerate(names)]


def _silent(stage: str, share: float) -> None:
    """Progress that nobody watches."""


def _one_of(value: str, option: str, allowed: tuple[str, ...]) -> str:
    if value not in allowed:
        raise SysidError(f"{option} {value!r}", allowed=", ".join(allowed))
    return value


def _finish(found: dict, as_json: bool, quiet: bool, show: str, run: Path) -> None:
    if as_json:
        print(json.dumps(found, allow_nan=False))
    elif not quiet:
        from . import terminal

        getattr(terminal, show)(found, run)


@contextmanager
def _progress(silent: bool, fits: int = 1, *, asks: bool = False):
    """Progress on standard error, a bar where somebody watches, else a line now and then; nothing where silent.

    Args:
        fits, asks: what the command does, as far as is known; see `progress.Course`.
    """
    if silent or sys.stderr is None:
        yield None
        return
    from .progress import Course
    from .terminal import progress_bar, progress_lines

    course = Course(fits, asks=asks)
    with progress_bar(course) if sys.stderr.isatty() else progress_lines(course) as report:
        yield report


_INTERRUPTED = 130


def main() -> None:
    """The `sysid` command: bad input is one line on standard error and exit status 2."""
    from .trusted import Untrusted, allow

    try:
        while True:
            try:
                status = app(prog_name="sysid", standalone_mode=False)
                if sys.stdout is not None:  # closed
                    sys.stdout.flush()
                break
            except Untrusted as error:
                if not (_TRUST["given"] or _allowed(error)):
                    raise
                allow(error.path, error.content)  # and from the start: no work was done
    except SysidError as error:
        _fail(str(error), 2)
    except typer.Exit as stop:
        status = stop.exit_code
    except (KeyboardInterrupt, typer.Abort):
        status = _INTERRUPTED
    except BrokenPipeError:
        _drop_output()
        status = 1
    except OSError as error:  # a full disk under the output, or under a file that nobody minds
        _drop_output()
        _fail(f"{error.filename or 'the output'} cannot be written or read ({error.strerror or error})", 1)
    except MemoryError:
        _fail("out of memory", 1)
    except Exception as error:
        # what click raises for a mistyped command carries its own status and message
        if hasattr(error, "format_message"):
            from .mistyped import said

            _fail(said(error), getattr(error, "exit_code", 2))
        if os.environ.get("SYSID_DEBUG"):
            raise
        _fail(f"internal error, {type(error).__name__}: {error}; SYSID_DEBUG=1 shows where", 1)
    if status == _INTERRUPTED:  # typer makes an exit of Ctrl-C and says nothing
        _fail(f"interrupted; {_kept(sys.argv[1:])}", _INTERRUPTED)
    sys.exit(status if isinstance(status, int) else 0)


def _allowed(untrusted) -> bool:
    """Ask, where somebody is there to answer."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    said = f"{untrusted.path}\nThe experiment names this Python file. It runs with all that you may do: read it first.\nLet it run, now and whenever it is as it is now? [y/N] "
    print(said, end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _kept(words: list[str]) -> str:
    """What of a command is there after Ctrl-C."""
    command = next((word for word in words if not word.startswith("-")), "")
    return {
        "study": "what was finished is kept, run it again to go on", "discover": "the steps that were shown are kept",
        "fetch": "the files that came whole are kept",
    }.get(command, "nothing was written")  # fmt: skip


def _drop_output() -> None:
    """Let nothing more be written to standard output: Python would try again when it ends."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fail(message: str, status: int) -> None:
    with suppress(OSError):  # nobody can be told
        print("sysid: " + " ".join(str(message).split()), file=sys.stderr)
    sys.exit(status)
