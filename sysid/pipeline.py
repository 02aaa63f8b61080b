"""The whole loop on one page; read this first.

    experiment -> robot, model
    logs -> motion (filtered) -> columns -> triangles
    triangles + prior -> fit, certificate, uncertainty
    fit + held-out logs -> predictions and errors
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from . import config, drives, gains, groups, late, listed_effects, load_doubt, locked_joints, masses, robot, rollout
from . import filters as filtering
from . import log as logs
from .compress import compress
from .drives import scale_is_told, with_drives
from .earlier_fit import read_inertias
from .estimate import Fit, identify
from .experiment_logs import Read, read, read_all
from .held_apart import prior_strength
from .inertia.consistency import is_consistent
from .log_spec import LogSpec
from .long_motion import prepare
from .long_prediction import predicted
from .model import Model
from .motion import Motion
from .notices import (
    refuse_no_row,
    refuse_no_torque,
    samples_of,
    tell_events,
    tell_left_out,
    tell_overlap,
    tell_same,
    tell_still,
    tell_undetermined,
)
from .plausible import WORSE, implausible
from .prediction import Prediction, predict
from .prior_weight import PriorWeight, with_weight
from .robot import Robot
from .shape_refinement import scattered
from .spec_values import AUTO
from .specs import Experiment
from .threads import single_threaded
from .warned import noticed, warn
from .workers import Mapped, crew

#: called with the stage's name and the share of it done, 0 to 1
Progress = Callable[[str, float], None]


def load(path: str | Path) -> Experiment:
    """The experiment in a YAML file, or in a folder's config.yaml. Raises ConfigError."""
    return config.load(path)


def started(experiment: Experiment) -> Experiment:
    """An experiment whose drives' free values have a start from its training logs; itself where none lacks one. Raises SysidError."""
    return gains.started(experiment, robot.load(experiment.robot, experiment.folder)) if experiment.actuator or experiment.data.torque else experiment


def build(experiment: Experiment) -> tuple[Robot, Model, np.ndarray]:
    """The robot, the model and the prior (bodies, 10) of an experiment. Raises RobotError, ConfigError."""
    machine = robot.load(experiment.robot, experiment.folder)
    parts = listed_effects.build(machine, experiment.model.effects, experiment.folder, experiment.data.logged, experiment.data.groups)
    structure = with_drives(parts, experiment)
    return machine, structure, _prior(experiment, structure)


@single_threaded
def fit(
    experiment: Experiment, *, filters: dict | None = None, strength: PriorWeight | None = None, progress: Progress | None = None, measured: Read | None = None,
    near: Model | None = None, before: Model | None = None, workers: int = 1, scheduler: str | None = None,
) -> Fit:
    """Identify an experiment: everything from its logs to its errors on held-out data.

    Args:
        filters, strength: what an earlier fit of the same logs chose, `Fit.filters` and `Fit.strength`; by default filters
            are compared again, and the weight of the prior is chosen where the experiment says so.
        measured: its logs, where they are at hand.
        near: its model with shape values that are not far from the best, where that is known: no others are searched.
        before: a model that its own grew from, whose shape values were found on the same logs: only the others start from many places.
        workers, scheduler: as of `workers.crew`: who reads, filters, compresses and predicts. What is found does not depend on it.

    Raises:
        SysidError: bad input, with the one line that says so. A search that does not converge does not raise; it
            is `fit.solution.converged`.
    """
    tell = progress or (lambda stage, share: None)
    if workers == 1 and scheduler is None:
        return _fit(experiment, filters, strength, tell, measured, (near, before), None)
    with crew(workers, scheduler, lambda text: tell(text, 0.0)) as mapped:
        return _fit(experiment, filters, strength, tell, measured, (near, before), mapped)


def _fit(experiment: Experiment, filters: dict | None, strength: PriorWeight | None, tell: Progress, measured: Read | None, known: tuple[Model | None, Model | None], mapped: Mapped | None) -> Fit:
    experiment = experiment if strength is None else with_weight(experiment, strength.value)
    seconds: dict[str, float] = {}
    with noticed() as notices:
        experiment = started(experiment)
        with _timed(seconds, "robot", tell):
            machine, structure, prior = build(experiment)
        for text in measured.notices if measured else ():
            warn(text)
        with _timed(seconds, "read", tell):
            train = measured.train if measured else read(experiment, machine, experiment.data.train, structure=structure, mapped=mapped)
        refuse_no_torque(train)
        if filters is None and (locks := locked_joints.elsewhere(experiment, machine)):
            warn("; ".join(locked_joints.says(locks)))
        seen = samples_of("train", train) if filters is None else []
        provenance = [_provenance("train", log, spec) for log, spec in zip(train, experiment.data.train)]
        with _timed(seconds, "filters", tell):
            how = {"progress": None if mapped else lambda share: tell("filters", share), "mapped": mapped}
            comparing = (lambda: filters) if filters is not None else filtering.begun(experiment, structure, train, prior, **how)
            # where a filter is given, others are at its neighbours while the logs go through it
            later = filters is None and mapped is not None and filtering.is_given(experiment)
            chosen = {} if later else comparing()
            preprocess = filtering.settled(experiment.preprocess, chosen)
        with _timed(seconds, "preprocess", tell):
            motion = prepare(train, preprocess, machine.joints, mapped)
            chosen = comparing() if later else chosen
            slow = late.slow_view(experiment, preprocess, structure, train, prior, mapped)
            del train, comparing  # the filtered motion holds all that is needed from here on
        refuse_no_row(motion)
        tell_still(motion, experiment.preprocess)
        tell_left_out(motion, preprocess)
        disturbed = tell_events("train", motion)
        with _timed(seconds, "shape", tell):
            shaped = late.refined(experiment, structure, motion, slow, prior, *known)
            structure, slopes, weight = shaped.model, shaped.slopes, shaped.strength
        with _timed(seconds, "compress", tell):  # the regressor is built and reduced chunk by chunk, never whole
            compressed = compress(slopes or structure, motion, progress=lambda share: tell("compress", share))
        with _timed(seconds, "weight", tell):
            weight = weight or prior_strength(experiment, structure, motion, compressed, prior)
        with _timed(seconds, "solve", tell):
            found = identify(with_weight(experiment, weight.value), structure, motion, compressed, prior, told=shaped.told)
            found = load_doubt.with_doubt(scattered(replace(found, strength=strength or weight), motion), motion)
        if not found.physically_consistent:
            names = [body.name for body, possible in zip(machine.bodies, is_consistent(found.pi)) if not possible]
            warn(f"impossible bodies: {', '.join(names or ['what an effect carries'])}; identified.urdf will not serve a simulator. model.inertia: log-cholesky keeps them possible")
        tell_undetermined(found, motion)
        with _timed(seconds, "masses", tell):  # what other fits are compared with has been asked what it lacks
            heavy = masses.implausible(found, motion if filters is None else None)
        with _timed(seconds, "predict", tell):
            predictions = {"train": predicted(structure, found.x, motion)}
            samples, left_out = {"train": motion.samples}, {"train": _left_out(motion)}
            del motion, slow
        with _timed(seconds, "test", tell):
            held_out = measured.test if measured else read(experiment, machine, experiment.data.test, structure=structure, mapped=mapped)
            provenance += [_provenance("test", log, spec) for log, spec in zip(held_out, experiment.data.test)]
            tell_overlap(experiment, provenance)
            tell_same(seen and [*seen, *samples_of("test", held_out)], experiment, provenance)
            motion = prepare(held_out, preprocess, machine.joints, mapped)
            del held_out
            disturbed += tell_events("test", motion)
            predictions["test"] = predicted(structure, found.x, motion)
            samples["test"], left_out["test"] = motion.samples, _left_out(motion)
            told = drives.found(experiment, structure, found.x, found.uncertainty.std, found.shape_std)
            let_go = rollout.rms(experiment, structure, found.x, motion)
        if not scale_is_told(experiment, machine.joints):
            warn("no joint's torque is known in N m: these logs tell masses, friction and gains up to one common factor, which the prior's masses choose; one known gain, or a payload of known mass, settles it")
        tell("left", 0.0)
        doubts = [*implausible(replace(found, predictions=predictions), motion.still, provenance)]
        heavy = masses.doubted(heavy, any(WORSE in text for text in doubts))
        for text in doubts if heavy is None else [heavy.says, *doubts]:
            warn(text)
    return replace(
        found, masses=masses.document(heavy), predictions=predictions, samples=samples, left_out=left_out, seconds=seconds, filters=chosen,
        logs=tuple(provenance), notices=tuple(notices), events=tuple(disturbed), drives=tuple(told), rollout=let_go, searched=shaped.searched,
    )  # fmt: skip


def refit(experiment: Experiment, before: Fit, *, filters: dict | None = None, **how) -> tuple[Fit, Fit, Callable[[], Fit]]:
    """Fit an experiment that grew from a fitted one.

    Returns:
        the fit as its file says; the same under the prior and the filter of the one before; and what
        makes the one before under its prior. Where no weight differs, that is the one before.

    Args:
        filters, how: as of `fit`.
    """
    after, logs = fit_grown(experiment, before, filters=filters, **how), how.get("measured")
    same = filtering.same(after.filters, own := before.filters)
    alike = after if same else fit_grown(experiment, before, filters=own, **how)
    if alike.strength.value == before.strength.value:
        return after, alike, lambda: before
    return after, _under(before.strength, alike, logs), lambda: _under(after.strength, before, logs)


def _under(strength: PriorWeight, found: Fit, measured: Read | None) -> Fit:
    """A fit's model as it would be under another weight of the prior, on the same triangles."""
    experiment = with_weight(found.experiment, strength.value)
    preprocess = filtering.settled(experiment.preprocess, found.filters)
    with noticed():  # of the logs the fit said it
        logs_ = measured or read_all(experiment, structure=found.model)
        train, test = (prepare(part, preprocess, found.joints) for part in logs_.parts)
        own = identify(experiment, found.model, train, found.compressed, found.prior)
        told = {part: predicted(own.model, own.x, motion) for part, motion in (("train", train), ("test", test))}
    same = ("samples", "left_out", "seconds", "filters", "logs", "notices", "events", "searched")
    return replace(own, strength=strength, predictions=told, **{name: getattr(found, name) for name in same})


def fit_grown(experiment: Experiment, before: Fit, **how) -> Fit:
    """The first of the fits of `refit`."""
    return fit(with_weight(experiment, AUTO) if before.strength.auto else experiment, before=before.model, **how)


def predict_log(found: Fit, log: str | LogSpec, *, levels: Mapping[str, str] | None = None) -> Prediction:
    """What a fitted model predicts on another log, read and filtered as the experiment says.

    Args:
        levels: {group: level} where effects are per group of logs; a log of data.groups has its own.

    Raises:
        SysidError: no such log or level.
    """
    spec = LogSpec(file=str(log)) if isinstance(log, (str, Path)) else log
    machine = found.model.robot
    model, x = found.model.at({**groups.levels_of(found.experiment.data.groups, spec), **(levels or {})}, found.x)
    motion = prepare(read(found.experiment, machine, [spec]), filtering.settled(found.experiment.preprocess, found.filters), machine.joints)
    return predict(model, x, motion)


def _prior(experiment: Experiment, structure: Model) -> np.ndarray:
    """The prior bodies: the URDF's, or those of a previous fit where it has them."""
    source = experiment.prior.source
    if source == "urdf":
        return np.array(structure.robot.prior)
    return read_inertias((experiment.folder / source).resolve(), structure)


def _left_out(motion: Motion) -> dict[str, int]:
    return dict(zip(motion.joints, motion.left_out.tolist()))


def _provenance(part: str, log: logs.Log, spec: LogSpec) -> dict:
    chosen = {key: value for key in ("topic", "episode") if (value := getattr(spec, key)) is not None}
    return {
        "part": part, "log": log.name, "sha256": log.sha256, "start": spec.start, "stop": spec.stop,
        "samples": log.samples, "segments": log.stretches, **chosen, **({"files": log.hashes} if len(log.hashes) > 1 else {}),
    }  # fmt: skip


@contextmanager
def _timed(seconds: dict[str, float], stage: str, tell: Progress):
    start = time.perf_counter()
    tell(stage, 0.0)
    yield
    seconds[stage] = time.perf_counter() - start
