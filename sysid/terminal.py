"""What the commands print for a person: tables, notices, a progress bar. Computes nothing."""

import json
import math
import shlex
import shutil
import sys
import threading
import time
from contextlib import contextmanager, suppress
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.text import Text

from . import progress
from .differences import give_or_take
from .estimate import Fit
from .export import exported
from .given_shapes import given_shapes, said_of_shapes
from .init.text import flow
from .statement import faults, sizes, tables, text

_LOW = 0.1  # below this share the prior, not the data, gave a parameter


@contextmanager
def progress_bar(course=None):
    """A bar with the stage and the time left; yields the function that pipelines call with (stage, share done)."""
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

    course = progress.Course() if course is None else course
    columns = (SpinnerColumn(), BarColumn(bar_width=20), TextColumn("{task.fields[left]}"), TextColumn("{task.description}"))
    begun = time.monotonic()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0, left="")

        def report(stage: str, share: float) -> None:
            if stage.startswith(progress.STAYS):
                bar.console.print(Text(f"sysid: {stage}"), soft_wrap=True)
                return
            words, whole = course.tell(stage, share)
            rest = progress.left(whole, time.monotonic() - begun)
            told = "" if rest is None else f"about {progress.spoken(rest)} left"
            bar.update(task, completed=whole, description=escape(words), left=told)

        yield report


_QUIET, _EVERY = 5.0, 15.0  # s before the first line of a log, and from line to line


@contextmanager
def progress_lines(course):
    """The same as lines for a log, the first after some seconds, then now and then, also where a stage tells nothing."""
    begun, lock, over = time.monotonic(), threading.Lock(), threading.Event()
    now = {"stage": "", "share": 0.0, "next": _QUIET}

    def say() -> None:
        elapsed = time.monotonic() - begun
        if not now["stage"] or elapsed < now["next"]:
            return
        now["next"] = elapsed + _EVERY
        rest = progress.left(now["share"], elapsed)
        told = f"{progress.spoken(elapsed)} so far" if rest is None else f"about {progress.spoken(rest)} left"
        line(f"{now['stage']}, {100 * now['share']:.0f} %, {told}")

    def line(said: str) -> None:
        with suppress(OSError, ValueError):  # a log that nobody can write is no reason to stop
            print(f"sysid: {said}", file=sys.stderr, flush=True)

    def tick() -> None:
        while not over.wait(1.0):
            with lock:
                say()

    def report(stage: str, share: float) -> None:
        with lock:
            if stage.startswith(progress.STAYS):
                line(stage)
                return
            now["stage"], now["share"] = course.tell(stage, share)
            say()

    thread = threading.Thread(target=tick, name="sysid-progress", daemon=True)
    thread.start()
    try:
        yield report
    finally:
        over.set()
        thread.join()


def show_init(found, file) -> None:
    """What was guessed of a robot and its logs, and why."""
    print(f"guessed, and written into {file} with the reasons")
    guesses = list(found.guesses.values())
    for guess in guesses:
        print("\n".join(text.wrapped(f"  {guess.key}: {flow(guess.value)} ({guess.why})", _width(), "      ")))
    doubts = [f"{guess.key}: {guess.doubt}" for guess in guesses if guess.doubt]
    for look in [*doubts, *found.notes]:
        print("\n".join(text.wrapped(f"LOOK {look}", _width(), "     ")))
    said = f"correct {file} where this is wrong" if doubts or found.notes else ""
    next_step("check", file.parent, first=said)


def next_step(command: str, *words, first: str = "") -> None:
    """The last line of a command: what is typed next, and what comes before it."""
    if first:
        print("\n".join(text.wrapped(f"{first}; then", _width(), "  ")))
    print(f"next: {shlex.join(['sysid', command, *map(str, words)])}")


def show_fit(fit: Fit, document: dict) -> None:
    """The errors of each joint, what the solver proved, and what was decided on the way."""
    robot, rms, relative = fit.model.robot, document["rms"], document["relative_error"]["test"]
    rows = [
        [joint, "N" if slides else "N m", _level(rms["train"][joint]), _level(rms["test"][joint]), _percent(relative[joint]), _four(document["r2"]["test"][joint])]
        for joint, slides in zip(fit.joints, robot.prismatic)
    ]  # fmt: skip
    _table(f"{fit.experiment.name}: residual by joint", ["joint", "", "RMS train", "RMS test", "relative test", "R2 test"], rows)
    print(f"RMS over the rows that count, {document['band']}; relative to the RMS of the joint's own torque")
    if fit.experiment.data.unused:
        print(f"of {', '.join(fit.experiment.data.unused)} no torque is used (data.unused)")
    _show_groups(document.get("groups", {}))
    certificate = document["certificate"]
    for own in document["drives"]:
        deviation = "" if own["std"] is None else f" +- {own['std']:.2g}"
        print(f"drive of {own['joint']}: {own['name']} = {own['value']:.6g}{deviation}{'' if own['unit'] == '1' else ' ' + own['unit']}")
    if document["rollout"]:
        missed = ", ".join(f"{joint} {value:.3g}" for joint, value in document["rollout"].items())
        print(f"rollout of the closed loop over the test logs, RMS of the angles it misses [rad or m]: {missed}")
    print(f"relative error, all joints: train {_percent(document['relative_error']['train']['*'])}, test {_percent(document['relative_error']['test']['*'])}")
    print(f"objective {document['objective']:.8g} after {document['iterations']} iterations, {'converged' if document['converged'] else 'NOT CONVERGED'}")
    known = certificate["gap"] is not None and certificate["gap"] < 1.0
    gap = f"at most {certificate['gap']:.1e} of it can be gained" if known else "no bound was found"
    given = given_shapes(fit)
    print(f"global optimum: {'proven' if certificate['globally_optimal'] else 'not proven'}{f' {given}' if given else ''} ({gap})")
    for said in said_of_shapes(fit):
        print(f"  {said}")
    _show_held(certificate["at_zero"])
    print(f"every body physically possible: {'yes' if document['physically_consistent'] else 'NO'}")
    weak = sum(entry["from_data"] < _LOW for entry in document["parameters"])
    by = "given by the prior rather than the data" if fit.experiment.prior.weight > 0 else "not determined by the data"
    print(f"{len(document['parameters'])} parameters, {weak} of them {by} (from_data below {_LOW:g})")
    _show_filter(document["filter"])
    print(document["prior"]["says"])
    _show_notices(document)
    print(f"run folder: {document['run']}")
    next_step("check" if _doubtful(document, fit.experiment) else "diagnose", _typed(fit.experiment))


def _typed(experiment) -> Path:
    """An experiment as it is typed: its folder, or its file where that has a name of its own."""
    return experiment.path.parent if experiment.path.name == "config.yaml" else experiment.path


def _implausible(document: dict) -> list[str]:
    return [notice for notice in document["notices"] if notice.startswith("implausible")]


def _doubtful(document: dict, experiment) -> bool:
    """Whether the logs are to be checked first: what came of them cannot be meant, and no check since the experiment file
    was written found them in order."""
    said = Path(document["run"]) / "check.json"
    with suppress(OSError, ValueError, KeyError):
        if said.stat().st_mtime >= experiment.path.stat().st_mtime and json.loads(said.read_text())["ok"]:
            return False
    return bool(_implausible(document))


def _show_held(at_zero: dict[str, float]) -> None:
    """The coefficients that a fit holds at zero, by effect: those of one kind are one line."""
    joints: dict[str, list[str]] = {}
    for name in at_zero:
        effect, _, rest = name.partition(".")
        joint, _, parameter = rest.rpartition(".")
        joints.setdefault(f"{effect} {parameter}", []).append(joint)
    for kind, own in joints.items():
        words = f"  {kind} went to zero and is held there, below which it cannot be, on {', '.join(own)}"
        print("\n".join(text.wrapped(words, _width(), "    ")))


def _show_groups(groups: dict) -> None:
    """Each level's value of what is per group of logs, and how far it is from the first level's."""
    for group, found in groups.items():
        print(f"per {group}, +- one standard deviation:")
        for p in found["parameters"]:
            apart = {d["to"]: d for d in p["differences"]}
            first, width = next(iter(p["levels"])), max(map(len, p["levels"]))
            print(f"  {p['parameter']} [{p['unit']}]")
            for level, at in p["levels"].items():
                other, line = apart.get(level), f"    {level:{width}}  {give_or_take(at)}"
                if other is not None:
                    times = f", {abs(other['value']) / other['std']:.1f} deviations" if other["std"] else ""
                    line = f"{line:{width + 28}}  {give_or_take(other, '+')} from {first}{times}"
                print(line)


def _show_filter(chosen: dict) -> None:
    key = "window" if "window" in chosen else "cutoff"
    unit = "s" if key == "window" else "Hz"
    if chosen["torque"] == "low-pass" and chosen["filter"] != "none":
        print(f"filter: {chosen['filter']}, window {chosen['window']:g} s; both sides under a low-pass at {chosen['cutoff']:g} Hz ({chosen['chosen']})")
        return
    if not chosen["held_out"]:
        print(f"filter: {chosen['filter']}")
        return
    values = [entry[key] for entry in chosen["held_out"]]
    at = values.index(chosen[key]) if chosen[key] in values else None
    near = chosen["held_out"] if at is None else chosen["held_out"][max(at - 1, 0) : at + 2]  # the others are in fit.json
    shown = ", ".join(f"{entry[key]:g} {unit}: {100 * entry['relative_error']:.2f} %" for entry in near)
    words = f"filter: {chosen['filter']}, {key} {chosen[key]:g} {unit} ({chosen['chosen']}); held-out error within the training logs, {shown}"
    print("\n".join(text.wrapped(words, _width(), "  ")))


def show_check(document: dict, experiment) -> None:
    """Every fault of the logs with its cure, the gravest first."""
    print("\n".join(faults.lines(document, _width())))
    next_step("fit" if document["ok"] else "check", _typed(experiment), first="" if document["ok"] else f"correct {experiment.path} or the logs")


_NEVER = 0.05  # probability below which a motion is no answer
_SHOWN_STD = 20  # parameters whose deviation falls most


_SEEN = 0.01  # rad or m: what less of a maneuver does is none


def show_design(document: dict) -> None:
    """What a designed motion promises, and what is left of its limits."""
    best = document["criterion"]["random_best"]
    beside = "" if best is None else f", {document['criterion']['log_det'] - best:.1f} above the best of the random motions it began from"
    print(f"{document['duration']:g} s of motion; log det of the information {document['criterion']['log_det']:.1f}{beside}")
    for own in document.get("maneuvers", ()):
        moved = [f"{joint} {size:+.2g}" for joint, size in own["joints"].items() if abs(size) > _SEEN]
        print(f"from {own['start']:g} s on a maneuver of {own['duration']:g} s, {own['kind']}: {', '.join(moved) or 'left out'}")
    left = [f"{name} {100 * share:.1f} %" for name, share in document["margins"].items() if name != "collision"]
    near = document["margins"].get("collision")
    print(f"left of the limits: {', '.join(left)}" + ("" if near is None else f"; links keep {near:.3g} m apart"))
    for pair in document["separates"]:
        if pair["probability"] < _NEVER:
            print(f"{pair['a']} and {pair['b']}: no motion within these limits is likely to tell them apart; `sysid effects` says what else does")
            continue
        print(f"{pair['a']} and {pair['b']} will be told apart with probability {pair['probability']:.2f}")
    told = [(name, s) for name, s in document["expected_std"].items() if s["now"] and s["now"] > 0.0]
    told.sort(key=lambda one: one[1]["after"] / one[1]["now"])
    if told:
        print("standard deviations that fall most, now and after:")
        for name, s in told[:_SHOWN_STD]:
            print(f"  {name}  {s['now']:.2g} -> {s['after']:.2g}")
    _show_notices(document)
    print(f"folder: {document['run']}")


def show_comparison(document: dict, experiments) -> None:
    """RMS of every experiment and the differences with their standard errors."""
    joints = list(dict.fromkeys(joint for entry in document["experiments"] for joint in entry["rms_test"]))
    rows = [
        [entry["name"], *(_level(entry["rms_test"][j]) if j in entry["rms_test"] else "" for j in joints), _percent(entry["relative_error"]["*"])]
        for entry in document["experiments"]
    ]  # fmt: skip
    _table("held-out RMS [N m, or N on a prismatic joint]", ["experiment", *joints, "relative"], rows)
    for entry in document["differences"]:
        se = "unknown: too few blocks" if entry["se"] is None else f"{entry['se']:.2g}"
        print(f"{entry['joint']}: {entry['from']} -> {entry['to']} {entry['delta_rms']:+.4g} (standard error {se})")
    _show_notices(document)
    errors = [entry["relative_error"]["*"] for entry in document["experiments"]]
    own = [k for k, one in enumerate(experiments) if not (one.folder / "fit.json").is_file()]  # not what is a run's
    if own:
        best = min(own, key=lambda k: float("inf") if errors[k] is None else errors[k])
        next_step("diagnose", _typed(experiments[best]))


def _table(title: str, heads: list[str], rows: list[list[str]]) -> None:
    """A table in the width of the terminal, the names on its left whole."""
    print("\n".join([title, *tables.fitted(heads, rows, 1, _width())]))


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.2f} %"


def _level(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _four(value: float | None) -> str:
    return "-" if value is None else f"{value:.4f}"


def show_diagnosis(found, document: dict, experiment=None) -> None:
    """The verdict in words, then what it rests on."""
    of, width = text.told(found, document), _width()
    _show_warnings(document)
    _show_verdict(of, width)
    parts = [tables.errors(of, width), tables.suspects(document, width), tables.events(document, width), tables.fails(document, width)]
    for lines in [*parts, sizes.fitting(document, found.fit.joints, width)]:
        if lines:
            print("\n" + "\n".join(lines))
    print()
    _show_notices({"notices": [n for n in document["notices"] if n not in _implausible(document)]})
    print(f"run folder: {document['run']}")
    if experiment is not None:
        _after_diagnosis(document, experiment)


def _show_warnings(document: dict) -> None:
    """First what makes all the rest doubtful."""
    if _implausible(document):
        _show_notices({"notices": _implausible(document)})
        print()


def _after_diagnosis(document: dict, experiment) -> None:
    """What is typed next: what checks logs that cannot be meant, the first addition, or the page with all of it."""
    commands = [c for v in document["verdict"] for c in v.get("commands", ())]
    first = min((f for f in document["findings"] if f["command"] in commands and f["joins_as_step"]), key=lambda f: f["joins_as_step"], default=None)
    if _doubtful(document, experiment):
        next_step("check", _typed(experiment))
    elif first is not None:
        print(f"next: {first['command']}")
    else:
        next_step("report", _typed(experiment), "--open")


def _width() -> int:
    return shutil.get_terminal_size().columns


def _show_verdict(of, width: int) -> None:
    """A paragraph a joint, what it begins with in bold."""
    console = Console()
    for lead, lines in text.verdict(of, width):
        whole = "\n".join(lines)
        # a name with spaces may be cut by the end of a line
        start = len(lead) if whole.startswith(lead) else 0
        words = Text(whole)
        words.stylize("bold", 0, start)
        console.print(words, soft_wrap=True, highlight=False)


def show_changed(document: dict) -> None:
    """What is different on a log while a fitted model is held."""
    rows = [[joint, _level(entry["rms"]["held"]), _level(entry["rms"]["after"])] for joint, entry in document["joints"].items()]
    _table("the held model on the new log, low-passed at 15 Hz [N m or N]", ["joint", "RMS held", "RMS with the changes"], rows)
    if not document["findings"]:
        print("nothing has changed that one half of the log would tell of the other")
    for f in document["findings"]:
        print(f"{f['effect']} on {f['joint']}: removes {text.percent(max(f['misfit_removed'], 0.0))} of the squared residual")
        for name, p in f["parameters"].items():
            print(f"  {text.valued(name, p)}")
    _show_notices(document)
    print(f"run folder: {document['run']}")


def show_fleet(document: dict) -> None:
    """Which robots are odd and in what; what differs, what is shared, what drifts."""
    rows = [[d["parameter"], ", ".join(d["odd"]), _level(d["value"]), d["unit"], _level(d["between"]), _level(d["within"])] for d in document["differs"]]
    if rows:
        _table("what differs from robot to robot", ["parameter", "odd", "mean", "unit", "between", "within"], rows)
    print(f"no difference can be told in {len(document['shared'])} of {len(document['shared']) + len(rows)} parameters")
    for d in document["drift"]:
        print(f"{d['parameter']} drifts by {d['per_year']:+.3g} +- {d['std']:.2g} {d['unit']} a year")
    for entry in document["failed"]:
        Console().print(f"[red]left out[/red] {escape(entry['experiment'])}: {escape(entry['says'])}", soft_wrap=True, highlight=False)
    _show_notices(document)
    count = len(document["robots"])
    if not document["odd"]:
        print(f"none of {count} robots is odd")
    for entry in document["odd"]:
        std = "" if entry["std"] is None else f" +- {entry['std']:.2g}"
        share = "" if entry["relative"] is None else f" ({100 * entry['relative']:+.0f} %)"
        tied = f"; these logs cannot tell it from a change of {' or '.join(entry['tied_with'])}" if entry["tied_with"] else ""
        print(f"{entry['robot']} is odd in {entry['parameter']}: {entry['size']:+.4g}{std} {entry['unit']} from the others{share}{tied}")
    print(f"probability of any false alarm: {100 * document['false_alarm_rate']:g} %")


def show_against(document: dict) -> None:
    """What is different on each of many logs while a fitted model is held."""
    rows = []
    for log, entry in document["logs"].items():
        changes = [f"{f['effect']} on {f['joint']}" + (f" {m['value']:.3g} kg" if (m := f["parameters"].get("payload.*.m")) else "") for f in entry["changes"]]
        ratio = max((entry["rms_held"][j] / after if after else 1.0) for j, after in entry["rms_after"].items())
        rows.append([log, ", ".join(changes) or "nothing changed", f"{ratio:.3g}"])
    _table(f"against {document['against']}: what changed, and how many times smaller the error of a joint is with it", ["log", "changed", "times"], rows)
    for entry in document["failed"]:
        Console().print(f"[red]left out[/red] {escape(entry['log'])}: {escape(entry['says'])}", soft_wrap=True, highlight=False)


def show_added(document: dict) -> None:
    """The held-out error before and after an effect."""
    before, after = document["rms_test_before"], document["rms_test_after"]
    rows = [
        [d["joint"], _level(before[d["joint"]]), _level(after[d["joint"]]), f"{d['delta_rms']:+.{_decimals(before[d['joint']])}f}", "-" if d["se"] is None else f"{d['se']:.2g}"]
        for d in document["differences"]
    ]  # fmt: skip
    _table(f"held-out RMS without and with {document['added']}", ["joint", "before", "after", "change", "standard error"], rows)
    for parameter in document["parameters"]:
        print(text.valued(parameter["name"], parameter))
    if document["says"]:
        Console().print(escape(document["says"]), soft_wrap=True, highlight=False)
    if not document["refused"]:
        print(f"written into {document['experiment']}")
    _show_notices(document)
    file = Path(document["experiment"])
    next_step("diagnose", file.parent if file.name == "config.yaml" else file)


def _decimals(level: float | None) -> int:
    """How many decimals four digits of an error have."""
    return 4 if not level else max(0, 3 - math.floor(math.log10(level)))


def show_step(step: dict) -> None:
    """One step of a discovery, as it is made."""
    what = "start" if step["added"] is None else f"+ {step['added']} on {step['joint']}"
    rms = ", ".join(f"{joint} {_level(value)}" for joint, value in step["rms_test"].items())
    Console().print(f"{escape(what)}: held-out RMS {escape(rms)}", soft_wrap=True, highlight=False)


def show_discovery(said: dict, found, document: dict, experiment=None) -> None:
    """Where a discovery ended."""
    for entry in said["refused"]:
        print(f"not claimed: {entry['effect']} on {entry['joint']}: {entry['why']}")
    _show_verdict(text.told(found, document), _width())
    print(f"steps and experiment files: {said['run']}/steps")
    if experiment is None:
        return
    if not said["commands"]:
        next_step("report", _typed(experiment), "--open")
        return
    print(f"{experiment.path} is as it was; what was found is written into it by")
    for command in said["commands"][1:]:
        print(f"  {command}")
    print(f"next: {said['commands'][0]}")


_LONGEST_BAR = 20  # twice the error of the start, or more


def show_history(steps: list[dict], experiment) -> None:
    """The steps, one a line, and the error of each joint as a falling row of bars."""
    joints, first = list(steps[0]["rms_test"]), steps[0]["rms_test"]

    def cell(rms: dict, joint: str) -> str:
        now, before = rms.get(joint), first.get(joint)
        bar = "#" * min(max(1, round(10 * now / before)), _LONGEST_BAR) if now and before else ""
        return f"{_level(now)} {bar.ljust(10)}" if joint in rms else ""

    rows = [
        [f"{number} start" if step["added"] is None else f"{number} + {step['added']} on {step['joint']}", *(cell(step["rms_test"], j) for j in joints)]
        for number, step in enumerate(steps)
    ]  # fmt: skip
    _table("held-out RMS [N m, or N on a prismatic joint]", ["step", *joints], rows)
    next_step("diagnose", _typed(experiment))


def show_export(found) -> None:
    """What was written, whether the simulator agrees, what the format cannot say."""
    width = shutil.get_terminal_size().columns
    for line in exported(found):
        print("\n".join(text.wrapped(line, width, "    ")))


def show_effects(found: list[dict]) -> None:
    """The catalogue, a line an effect; of one alone all that is known."""
    if len(found) > 1:
        left = max(len(effect["name"]) for effect in found)
        for effect in found:
            words = f"{effect['name']:<{left}}  {effect['summary'].partition('. ')[0].rstrip('.')}"
            print("\n".join(text.wrapped(words, _width(), " " * (left + 2))))
        print("next: sysid effects NAME")
        return
    for effect in found:
        print(f"{effect['name']}: {effect['summary']}")
        print(f"  kind         {effect['kind']}, of {'the whole robot' if effect['scope'] == 'robot' else 'a joint'}")
        print(f"  equation     {effect['equation']}")
        for parameter in effect["parameters"]:
            unit = "" if parameter["unit"] == "1" else f" {parameter['unit']}"
            print(f"  {parameter['name']:<12}{unit}{_bounds(parameter)}: {parameter['says']}")
        for option, says in effect["options"].items():
            print(f"  {option + ':':<12} {says}")
        print(f"  looks like   {effect['looks_like']}")
        print(f"  tied with    {', '.join(effect['tied_with']) or 'nothing known'}")
        print(f"  separate by  {effect['separate_by']}")
        if effect.get("maneuvers"):
            print(f"  maneuvers    {', '.join(effect['maneuvers'])}: `sysid design --separate` tries them")
        print(f"  source       {effect['source']}")


_SHARES = {"speed": "times the joint's top speed", "torque": "times its greatest torque", "angle": "times the angle it travels", "softness": "times the angle it travels over its greatest torque", "duration": "times the longest log"}


def _bounds(parameter: dict) -> str:
    """What a parameter may be, in words."""
    if "upper" not in parameter:
        return ", not negative" if parameter["lower"] == 0 else ""
    share = _SHARES.get(parameter["share_of"])
    return f", {parameter['lower']:g} to {parameter['upper']:g}" + (f" {share}" if share else "")


def show_bodies(document: dict, run) -> None:
    """What section VI counts."""
    linear, total = document["linear"], document["bodies"]
    print(f"{total} random bodies, {document['reading']}")
    print(
        f"linear least squares: {linear['nonphysical_count']} not physical ({100 * linear['nonphysical']:.1f} %), {linear['negative_mass']} of negative mass, "
        f"{linear['inertia_not_positive']} with inertia not positive, {linear['triangle_violated']} violate a triangle inequality (about the centre of mass)"
    )
    rows = []
    for name, entry in document["parameterizations"].items():
        low, high = entry["range_90"]
        rows.append([name, f"{entry['median_iterations']:g}", f"{low:g} to {high:g}", str(entry["failures"]), f"{entry['seconds_per_iteration']:.1e}", f"{entry['newton']['median_iterations']:g}"])
    heads = ["parameterization", "median", "5 % to 95 %", "not converged", "s per iteration", "own solver: median"]
    _table("iterations until convergence", heads, rows)
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
        lines = escape("\n".join(text.wrapped(f"note {notice}", _width(), "  "))).removeprefix("note")
        console.print(f"[yellow]note[/yellow]{lines}", soft_wrap=True, highlight=False)
