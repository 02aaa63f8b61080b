"""What the commands print for a person: tables, notices, a progress bar. Computes nothing."""

from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .estimate import Fit

_LOW = 0.1  # below this share the prior, not the data, gave a parameter


@contextmanager
def progress_bar():
    """A bar for each stage; yields the function that pipelines call with (stage, share done)."""
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        tasks: dict[str, object] = {}

        def report(stage: str, share: float) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=1.0)
            bar.update(tasks[stage], completed=share)

        yield report


def show_fit(fit: Fit, document: dict) -> None:
    """The errors of each joint, what the solver proved, and what was decided on the way."""
    console = Console()
    robot = fit.model.robot
    table = Table(title=f"{escape(fit.experiment.name)}: residual by joint", title_justify="left")
    for heading in ("joint", "", "RMS train", "RMS test", "relative test", "R2 test"):
        table.add_column(heading, justify="left" if heading == "joint" else "right")
    for joint, prismatic in zip(fit.joints, robot.prismatic):
        table.add_row(
            escape(joint), "N" if prismatic else "N m", f"{document['rms']['train'][joint]:.4g}", f"{document['rms']['test'][joint]:.4g}",
            _percent(document["relative_error"]["test"][joint]), _four(document["r2"]["test"][joint]),
        )  # fmt: skip
    console.print(table)
    certificate = document["certificate"]
    print(f"relative error, all joints: train {_percent(document['relative_error']['train']['*'])}, test {_percent(document['relative_error']['test']['*'])}")
    print(f"objective {document['objective']:.8g} after {document['iterations']} iterations, {'converged' if document['converged'] else 'NOT CONVERGED'}")
    known = certificate["gap"] is not None and certificate["gap"] < 1.0
    gap = f"at most {certificate['gap']:.1e} of it can be gained" if known else "no bound was found"
    print(f"global optimum: {'proven' if certificate['globally_optimal'] else 'not proven'} ({gap})")
    for name, slope in certificate["at_zero"].items():
        print(f"  {name} went to zero and is held there (gradient {slope:+.3g})")
    print(f"every body physically possible: {'yes' if document['physically_consistent'] else 'NO'}")
    weak = sum(entry["from_data"] < _LOW for entry in document["parameters"])
    by = "given by the prior rather than the data" if fit.experiment.prior.weight > 0 else "not determined by the data"
    print(f"{len(document['parameters'])} parameters, {weak} of them {by} (from_data below {_LOW:g})")
    _show_filter(document["filter"])
    _show_notices(document)
    print(f"run folder: {document['run']}")


def _show_filter(chosen: dict) -> None:
    key = "window" if "window" in chosen else "cutoff"
    unit = "s" if key == "window" else "Hz"
    if not chosen["held_out"]:
        print(f"filter: {chosen['filter']}")
        return
    shown = ", ".join(f"{entry[key]:g} {unit}: {100 * entry['relative_error']:.2f} %" for entry in chosen["held_out"])
    print(f"filter: {chosen['filter']}, {key} {chosen[key]:g} {unit} ({chosen['chosen']}); held-out error within the training logs, {shown}")


def show_comparison(document: dict) -> None:
    """RMS of every experiment and the differences with their standard errors."""
    console = Console()
    joints = list(dict.fromkeys(joint for entry in document["experiments"] for joint in entry["rms_test"]))
    table = Table(title="held-out RMS [N m, or N on a prismatic joint]", title_justify="left")
    table.add_column("experiment")
    for joint in joints:
        table.add_column(escape(joint), justify="right")
    table.add_column("relative", justify="right")
    for entry in document["experiments"]:
        cells = [f"{entry['rms_test'][joint]:.4g}" if joint in entry["rms_test"] else "" for joint in joints]
        table.add_row(escape(entry["name"]), *cells, _percent(entry["relative_error"]["*"]))
    console.print(table)
    for entry in document["differences"]:
        se = "unknown: too few blocks" if entry["se"] is None else f"{entry['se']:.2g}"
        print(f"{entry['joint']}: {entry['from']} -> {entry['to']} {entry['delta_rms']:+.4g} (standard error {se})")
    _show_notices(document)


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.2f} %"


def _four(value: float | None) -> str:
    return "-" if value is None else f"{value:.4f}"


def show_effects(found: list[dict]) -> None:
    """The catalogue, one block an effect."""
    for effect in found:
        print(f"{effect['name']}: {effect['summary']}")
        print(f"  equation     {effect['equation']}")
        for parameter in effect["parameters"]:
            bound = ", not negative" if parameter["lower"] == 0 else ""
            print(f"  {parameter['name']:<12} {parameter['unit']}{bound}: {parameter['says']}")
        print(f"  looks like   {effect['looks_like']}")
        print(f"  tied with    {', '.join(effect['tied_with']) or 'nothing known'}")
        print(f"  separate by  {effect['separate_by']}")
        print(f"  source       {effect['source']}")


def show_bodies(document: dict, run) -> None:
    """What section VI counts."""
    linear, total = document["linear"], document["bodies"]
    print(f"{total} random bodies, {document['reading']}")
    print(
        f"linear least squares: {linear['nonphysical_count']} not physical ({100 * linear['nonphysical']:.1f} %), {linear['negative_mass']} of negative mass, "
        f"{linear['inertia_not_positive']} with inertia not positive, {linear['triangle_violated']} violate a triangle inequality (about the centre of mass)"
    )
    table = Table(title="iterations until convergence", title_justify="left")
    for heading in ("parameterization", "median", "5 % to 95 %", "not converged", "s per iteration", "own solver: median"):
        table.add_column(heading, justify="left" if heading == "parameterization" else "right")
    for name, entry in document["parameterizations"].items():
        low, high = entry["range_90"]
        table.add_row(name, f"{entry['median_iterations']:g}", f"{low:g} to {high:g}", str(entry["failures"]), f"{entry['seconds_per_iteration']:.1e}", f"{entry['newton']['median_iterations']:g}")
    Console().print(table)
    print(f"figures and tables: {run}")


def show_restarts(document: dict, run) -> None:
    """Where the random starts began and ended."""
    first, last = document["initial_rms_train"], document["rms_test"]
    print(f"{document['restarts']} random starts, training RMS at the start {min(first):.3g} to {max(first):.3g} N m")
    print(f"{document['converged']} converged, {document['globally_optimal']} proven globally optimal, after {min(document['iterations'])} to {max(document['iterations'])} iterations")
    print(f"objective {min(document['objective']):.10g}, relative spread {document['relative_spread']:.1e}; RMS on test logs {min(last):.6g} to {max(last):.6g} N m")
    print(f"figure and table: {run}")
    _show_notices(document)


def show_prior(document: dict, run) -> None:
    """The curve of held-out error against the prior's weight."""
    for weight, rms in zip(document["weights"], document["rms_held_out"]):
        marks = [text for value, text in ((document["chosen"], "least"), (document["experiment_weight"], "this experiment")) if value == weight]
        print(f"{weight:8.0e}  held-out RMS {rms:.6g} N m  {', '.join(marks)}".rstrip())
    print(f"strongest prior within one standard error of the least: {document['largest_within_one_se']:g}")
    print(f"curve: {run}")
    _show_notices(document)


def _show_notices(document: dict) -> None:
    console = Console()
    for notice in document["notices"]:
        console.print(f"[yellow]note[/yellow] {escape(notice)}", soft_wrap=True, highlight=False)
