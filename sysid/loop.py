"""Add an effect, refit, compare; again until nothing is missing. Every step is a run folder that can be reproduced.

    runs/<experiment>/history.json      the steps: what was added, to which joint, the held-out error after it
    runs/<experiment>/steps/NN-…        one run folder each, whose experiment.yaml gives the same fit again
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from . import bounded, comparison, config, experiment_file, fit_document, pipeline, results, state, whole_files
from .addition import spelled
from .borne_out import CLEAR, size_told
from .diagnose.diagnosis import Diagnosis, diagnose
from .effect_entry import asked, with_effect
from .errors import SysidError
from .estimate import Fit
from .given_shapes import at_edges
from .specs import Experiment
from .statement import kept
from .warned import noticed

_HISTORY, _STEPS = "history.json", "steps"


@dataclass(frozen=True)
class Added:
    """An effect that joined an experiment: the fits before and after, and on each joint the difference of the held-out RMS
    with its standard error. `rises` are those of the effect's own joints, or `*` over all joints as a share of what the error
    was, that rise by more than their standard error; `refused` says that for them nothing was written."""

    experiment: Experiment
    before: Fit
    after: Fit
    differences: tuple[comparison.Difference, ...]
    rises: tuple[comparison.Difference, ...] = ()
    refused: bool = False

    @property
    def says(self) -> str:
        """Why it was refused, in one line; empty where nothing rises."""
        if not self.rises:
            return ""
        risen = " and ".join(
            f"over all joints by {100 * d.delta_rms:.2g} % (standard error {100 * d.se:.2g} %)" if d.joint == "*"
            else f"on {d.joint} by {d.delta_rms:.3g} (standard error {d.se:.2g})" for d in self.rises
        )  # fmt: skip
        done = "not added" if self.refused else "added all the same"
        fell = {d.joint for d in self.differences if d.delta_rms < 0.0} & {d.joint for d in self.rises}
        under = "under the prior as it was, with which the fit before is told, " if fell else ""
        rest = "; what falls above falls by another weight of the prior" if fell else ""
        return f"{done}: {under}it makes the held-out error rise {risen}{rest}" + ("; --force adds it all the same" if self.refused else "")


# ---- the experiment file


# ---- one step


def add(
    path: Path, effect: str, joints: list[str] | None, options: dict, *, force: bool = False, progress=None, out: Path | None = None
) -> Added:  # fmt: skip
    """Write an effect into an experiment file, or into a folder's config.yaml, refit, and say what that changed.

    The file is written last: where the effect cannot be, the fit fails, or the held-out error of the effect's joints (of all
    joints where it has none of its own) rises by more than its standard error, or another joint's rises clearly and by more than any
    joint's falls, everything stays as it was.

    Args:
        force: write it also where the error rises.

    Raises:
        SysidError: bad input.
    """
    experiment = pipeline.load(path)
    run = whole_files.folder(out or Path("runs") / experiment.name)
    file = experiment.path
    joints = None if joints == ["*"] else joints  # every joint, or the whole robot
    read = experiment_file.read(file)
    with noticed():  # what is decided of the robot the fits say
        every = pipeline.build(experiment)[0].joints
    with noticed(), asked(file):
        text = with_effect(experiment_file.text(read, str(file)), effect, joints, options, str(file), every=every)
        after = config.loads(text, file)
        pipeline.build(after)
    before_fit = pipeline.fit(experiment, progress=progress)
    after_fit, compared, without = pipeline.refit(after, before_fit, progress=progress)
    differences = tuple(comparison.compare(before_fit, after_fit, ("before", "after")))
    rises = comparison.rises(before_fit, compared, joints)
    # a prior that was chosen without it may hold bodies against it: under its own, and as the user sees it, the error falls
    if rises and compared is not after_fit and not any(comparison.rises(one, after_fit, joints) for one in (before_fit, without())):
        rises = ()
    # what is written, and seen, is the fit under its own prior
    rises = rises or comparison.rises(before_fit, after_fit, joints)
    rises = rises or comparison.spoiled(before_fit, (compared, after_fit), joints)
    if rises and not force:
        return Added(after, before_fit, after_fit, differences, rises, refused=True)
    with state.locked(file):
        if experiment_file.read(file) != read:
            raise experiment_file.Changed("the experiment file changed while the effect was fitted, and nothing was written", where=str(file), do="run the command again")
        with state.locked(run):
            steps = read_history(run)
            history = _continued(run, before_fit)
            named = "*" if joints is None else ", ".join(joints)
            history.append(_record(run, len(history), after_fit, effect, named))
            # the file comes last: a history that is a step ahead of it is put right by the next step, one that lacks a step is not
            _write_history(run, history)
            try:
                results.write(after_fit, run)
                experiment_file.replace(file, read, experiment_file.edited(read, text))
            except SysidError:
                _write_history(run, steps)
                raise
    return Added(after, before_fit, after_fit, differences, rises)


def _continued(run: Path, fit: Fit) -> list[dict]:
    """The steps of a run folder that lead to a fit, its own the last of them; itself as the start where none does."""
    steps = read_history(run)
    for k in range(len(steps) - 1, -1, -1):
        if steps[k].get("rms_test") == fit.rms("test"):
            return steps[: k + 1]
    return [_record(run, 0, fit, None, None)]


def _record(run: Path, number: int, fit: Fit, effect: str | None, joint: str | None) -> dict:
    """Write one step's folder; returns what the history says of it."""
    word = "start" if effect is None else "-".join(c for c in (effect.rpartition(":")[2], "" if joint in (None, "*") else joint.replace(", ", "-")) if c)
    safe = "".join(c if c.isalnum() or c in "-_." else "_" for c in word)
    folder = run / _STEPS / f"{number:02d}-{safe}"
    results.write(fit, folder)
    return {"added": effect, "joint": joint, "rms_test": fit.rms("test"), "rms_train": fit.rms("train"), "folder": str(folder.relative_to(run))}


def read_history(run: Path) -> list[dict]:
    """The steps of a run folder, oldest first; empty where there are none."""
    try:
        found = json.loads(bounded.read_text(run / _HISTORY))["steps"]
        return found if all(isinstance(step["rms_test"], dict) for step in found) else []
    except (OSError, ValueError, KeyError, TypeError):
        return []


def _write_history(run: Path, steps: list[dict], **more) -> None:
    whole_files.write_json(run / _HISTORY, {"steps": steps, **more})


def _forget(run: Path, steps: list[dict]) -> None:
    """Remove the folders of steps that no history names any more."""
    kept = {step.get("folder") for step in steps}
    for path in (run / _STEPS).glob("*"):
        if str(path.relative_to(run)) not in kept:
            shutil.rmtree(path, ignore_errors=True)


# ---- until nothing is missing


@dataclass(frozen=True)
class Discovery:
    """The steps that held-out data support, as the history has them; the fits; the last diagnosis, and its document as `said`;
    what the search found and was not claimed, with why; what is typed to write what was found into the experiment file."""

    steps: list[dict]
    experiment: Experiment
    fits: list[Fit]
    diagnosis: Diagnosis
    said: dict
    refused: list[dict]
    commands: list[str]


def discover(experiment: Experiment, run: Path, *, most: int = 10, progress=None, each: Callable[[dict], None] | None = None) -> Discovery:
    """Diagnose, add what is claimed, and again, until nothing more is. The experiment's file stays as it is.

    Args:
        most: effects to add at most. each: called with each step as it is made.
    """
    tell = each or (lambda step: None)
    found = diagnose(experiment, progress=progress)
    with state.locked(run):
        fits, steps = [found.fit], _continued(run, found.fit)
        _write_history(run, steps)
        # what `sysid report` of the experiment as it is asks for
        whole_files.write_json(run / steps[-1]["folder"] / kept.FILE, kept.sealed(experiment, found, run))
    refused = {(r.effect, r.joint): r for r in found.refused}
    for step in steps:
        tell(step)
    most, commands = most + len(steps), []
    while found.claims and len(steps) < most:
        for claim in found.claims[: most - len(steps)]:
            commands.append(claim.head.command)
            fits.append(claim.after)
            with state.locked(run):  # a search that is interrupted keeps the steps that it made
                made = _record(run, len(steps), claim.after, spelled(claim.head.candidate, claim.head.joint)[0], claim.head.joint)
                steps.append({**made, "command": claim.head.command})
                _write_history(run, steps)
            tell(steps[-1])
        found = diagnose(fits[-1].experiment, fit=fits[-1], progress=progress)
        refused |= {(r.effect, r.joint): r for r in found.refused}
    results.write(fits[-1], run)
    said = kept.sealed(found.fit.experiment, found, run)
    whole_files.write_json(run / kept.FILE, said)
    left = [{"effect": r.effect, "joint": r.joint, "why": r.why} for r in refused.values()]
    with state.locked(run):
        _write_history(run, steps, verdict=said["verdict"], refused=left)
        _forget(run, steps)
    return Discovery(steps, fits[-1].experiment, fits, found, said, left, commands)


# ---- what the commands say


def document(added: Added) -> dict:
    """The document of `sysid add`."""
    there = added.before.experiment.model.effects
    # a joint may have joined an entry that the file has already
    name = next((spec.name for spec in added.experiment.model.effects if spec not in there), added.experiment.model.effects[-1].name)
    model = added.before.model
    before = {*model.names, *(value.name for value in model.shape_values)}
    found = fit_document.document(added.after)
    own = [p for p in found["parameters"] if p["name"] not in before]
    return {
        "added": name, "experiment": str(added.experiment.path), "rms_test_before": added.before.rms("test"), "rms_test_after": added.after.rms("test"),
        "refused": added.refused, "says": added.says,
        "differences": [{"joint": d.joint, "delta_rms": d.delta_rms, "se": fit_document.number(d.se)} for d in added.differences],
        "parameters": own, "untold": _untold(added, name), "converged": found["converged"], "notices": [*found["notices"], *at_edges(added.after)],
    }  # fmt: skip


def _untold(added: Added, name: str) -> str:
    """What to know of an effect whose size is nothing beside its deviations and that lowers no error; empty of others."""
    model, before = added.after.model, {*added.before.model.names, *(v.name for v in added.before.model.shape_values)}
    new = {(c.effect, c.joint) for c in model.coefficients if c.name not in before}
    new |= {(model.terms[v.term][0].name, v.joint) for v in model.shape_values if v.name not in before}
    falls = any(-d.delta_rms > CLEAR * d.se for d in added.differences)
    if added.refused or not new or falls or any(size_told(added.after, *own) for own in new):
        return ""
    return (
        f"nothing in these logs speaks for {name}: its size is nothing beside its standard deviation, and no held-out error falls by two of its "
        f"standard errors; take it out of model.effects in {added.experiment.path} unless you know that it is there"
    )
