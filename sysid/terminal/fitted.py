"""What a fit found, and what stands before and beside it: a first file, faults of logs, comparisons, exports."""

import shutil

from ..addition import typed
from ..differences import give_or_take
from ..estimate import Fit
from ..export import exported
from ..given_shapes import given_shapes, said_of_shapes
from ..init.text import flow
from ..statement import faults, text
from ..units import behind
from .next_steps import mended_first, next_step, out_of
from .tables import four, number, percent, show_notices, table, terminal_width

_LOW = 0.1  # below this share the prior, not the data, gave a parameter


def show_init(found, file) -> None:
    """What was guessed of a robot and its logs, and why."""
    print(f"guessed, and written into {file} with the reasons")
    guesses = list(found.guesses.values())
    for guess in guesses:
        print("\n".join(text.wrapped(f"  {guess.key}: {flow(guess.value)} ({guess.why})", terminal_width(), "      ")))
    doubts = [f"{guess.key}: {guess.doubt}" for guess in guesses if guess.doubt]
    for look in [*doubts, *found.notes]:
        print("\n".join(text.wrapped(f"LOOK {look}", terminal_width(), "     ")))
    said = f"correct {file} where this is wrong" if doubts or found.notes else ""
    next_step("check", file.parent, first=said)


def show_fit(fit: Fit, document: dict) -> None:
    """The errors of each joint, what the solver proved, and what was decided on the way."""
    robot, rms, relative = fit.model.robot, document["rms"], document["relative_error"]["test"]
    rows = [
        [joint, "N" if slides else "N m", number(rms["train"][joint]), number(rms["test"][joint]), percent(relative[joint]), four(document["r2"]["test"][joint])]
        for joint, slides in zip(fit.joints, robot.prismatic)
    ]  # fmt: skip
    table(f"{fit.experiment.name}: residual by joint", ["joint", "", "RMS train", "RMS test", "relative test", "R2 test"], rows)
    print(f"RMS over the rows that count, {document['band']}; relative to the RMS of the joint's own torque")
    if named := fit.experiment.data.unused:
        print(f"of {', '.join(named)} no torque is used (data.unused)")
    if silent := [joint for joint in fit.unused if joint not in named]:
        print(f"of {', '.join(silent)} no torque was logged")
    _show_groups(document.get("groups", {}))
    certificate = document["certificate"]
    for own in document["drives"]:
        deviation = "" if own["std"] is None else f" +- {own['std']:.2g}"
        print(f"drive of {own['joint']}: {own['name']} = {own['value']:.6g}{deviation}{behind(own['unit'])}")
    if document["rollout"]:
        missed = ", ".join(f"{joint} {value:.3g}" for joint, value in document["rollout"].items())
        print(f"rollout of the closed loop over the test logs, RMS of the angles it misses [rad or m]: {missed}")
    print(f"relative error, all joints: train {percent(document['relative_error']['train']['*'])}, test {percent(document['relative_error']['test']['*'])}")
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
    show_notices(document)
    print(f"run folder: {document['run']}")
    if not mended_first(document, fit.experiment, fit, diagnosed=False):
        next_step("diagnose", typed(fit.experiment.path), out=out_of(fit.experiment, document["run"]))


def _show_held(at_zero: dict[str, float]) -> None:
    """The coefficients that a fit holds at zero, by effect: those of one kind are one line."""
    joints: dict[str, list[str]] = {}
    for name in at_zero:
        effect, _, rest = name.partition(".")
        joint, _, parameter = rest.rpartition(".")
        joints.setdefault(f"{effect} {parameter}", []).append(joint)
    for kind, own in joints.items():
        words = f"  {kind} is zero, the least that it can be, on {', '.join(own)}"
        print("\n".join(text.wrapped(words, terminal_width(), "    ")))


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
    low = chosen["torque"] == "low-pass" and chosen["filter"] != "none"
    key = "window" if "window" in chosen and not low else "cutoff"
    unit = "s" if key == "window" else "Hz"
    if low:
        words = f"filter: {chosen['filter']}, window {chosen['window']:g} s; both sides under a low-pass at {chosen['cutoff']:.3g} Hz ({chosen['chosen']})"
    elif chosen["held_out"]:
        words = f"filter: {chosen['filter']}, {key} {chosen[key]:g} {unit} ({chosen['chosen']})"
    else:
        words = f"filter: {chosen['filter']}"
    if chosen["held_out"]:
        values = [entry[key] for entry in chosen["held_out"]]
        at = values.index(chosen[key]) if chosen[key] in values else None
        near = chosen["held_out"] if at is None else chosen["held_out"][max(at - 1, 0) : at + 2]  # the others are in fit.json
        shown = ", ".join(f"{entry[key]:g} {unit}: {100 * entry['relative_error']:.2f} %" for entry in near)
        words += f"; relative error on stretches of the training logs that were held apart: {shown}"
    print("\n".join(text.wrapped(words, terminal_width(), "  ")))


def show_check(document: dict, experiment, run) -> None:
    """Every fault of the logs with its cure, the gravest first."""
    print("\n".join(faults.lines(document, terminal_width())))
    done = faults.fit_can_be_made(document)
    next_step("fit" if done else "check", typed(experiment.path), first="" if done else f"correct {experiment.path} or the logs", out=out_of(experiment, run))


def show_comparison(document: dict, experiments) -> None:
    """RMS of every experiment and the differences with their standard errors."""
    joints = list(dict.fromkeys(joint for entry in document["experiments"] for joint in entry["rms_test"]))
    rows = [
        [entry["name"], *(number(entry["rms_test"][j]) if j in entry["rms_test"] else "" for j in joints), percent(entry["relative_error"]["*"])]
        for entry in document["experiments"]
    ]  # fmt: skip
    table("held-out RMS [N m, or N on a prismatic joint]", ["experiment", *joints, "relative"], rows)
    for entry in document["differences"]:
        se = "unknown: too few blocks" if entry["se"] is None else f"{entry['se']:.2g}"
        print(f"{entry['joint']}: {entry['from']} -> {entry['to']} {entry['delta_rms']:+.4g} (standard error {se})")
    show_notices(document)
    errors = [entry["relative_error"]["*"] for entry in document["experiments"]]
    own = [k for k, one in enumerate(experiments) if not (one.folder / "fit.json").is_file()]  # not what is a run's
    if own:
        best = min(own, key=lambda k: float("inf") if errors[k] is None else errors[k])
        next_step("diagnose", typed(experiments[best].path))


def show_export(found) -> None:
    """What was written, whether the simulator agrees, what the format cannot say."""
    width = shutil.get_terminal_size().columns
    for line in exported(found):
        print("\n".join(text.wrapped(line, width, "    ")))
