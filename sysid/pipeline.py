"""The whole loop on one page; read this first.

    experiment -> robot, model
    logs -> motion (filtered) -> columns -> triangles
    triangles + prior -> fit, certificate, uncertainty
    fit + held-out logs -> predictions and errors
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from . import config, drives, events, gains, groups, held_apart, long_log, masks, masses, model, robot, rollout, shape
from . import filters as filtering
from . import log as logs
from .bumps import bumps
from .compress import compress
from .drives import rescaled, scale_is_told, with_drives
from .effect import NotFinite
from .errors import LogError, SysidWarning
from .estimate import Fit, identify
from .inertia.consistency import is_consistent
from .linearised import Linearised
from .long_motion import prepare
from .long_prediction import predicted
from .model import Model, moving_coefficients
from .motion import Motion
from .multistart import Searched, finite
from .plausible import implausible
from .prediction import Prediction, predict
from .prior_weight import PriorWeight, is_auto, with_weight
from .robot import Robot
from .spans import Spans, released
from .specs import AUTO, Experiment, LogSpec
from .threads import single_threaded
from .triangles import Compressed
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
    parts = model.build(machine, experiment.model.effects, experiment.folder, experiment.data.logged, experiment.data.groups)
    structure = with_drives(parts, experiment)
    return machine, structure, _prior(experiment, structure)


def read(experiment: Experiment, machine: Robot, specs: list[LogSpec], *, structure: Model | None = None, mapped: Mapped | None = None) -> list[logs.Log]:
    """The logs of an experiment's `data.train` or `data.test`, with their events where these are left out, and what the experiment
    masks.

    Args:
        structure: the model that they are read for: where nothing of it looks at a log as a whole, long logs are spans, which are read
            when they are asked for. None: they are read whole.
        mapped: what shares long logs among processes, as of `workers.crew`; None: there is this one.

    Raises:
        LogError: as `log.read`. ConfigError: a mask that cannot be.
    """
    reader = long_log if structure is not None and structure.local else logs
    how = (experiment.data, machine.joints, machine.prismatic, experiment.folder, experiment.actuator)
    if mapped and reader is long_log and any(long_log.in_parts(spec, *how) for spec in specs):
        # where one log is long, each is looked at by itself
        found = list(mapped(_read_one, ((machine, experiment.preprocess.events, spec, how) for spec in specs)))
    else:
        read = [reader.read(spec, *how) for spec in specs]
        found = read if experiment.preprocess.events == "keep" else with_events(machine, read)
    return masks.masked(found, experiment.preprocess.mask, machine.joints)


def _read_one(machine: Robot, kept: str, spec: LogSpec, how: tuple) -> logs.Log:
    log = long_log.read(spec, *how)
    return log if kept == "keep" else with_events(machine, [log])[0]


_BESIDE = 1024  # rows of a span's neighbours that are looked at with it: more than an event's surroundings


def with_events(machine: Robot, read: list[logs.Log], *, among: int = 1) -> list[logs.Log]:
    """Logs with their events: first those that the signals show, then those that only the robot's equations do. Each span of a long
    log is looked at by itself.

    Args:
        among: how many parts their log has, where these are the spans of one.
    """
    if any(isinstance(log.segments, Spans) for log in read):
        return [with_events(machine, [log])[0] if not isinstance(log.segments, Spans) else _with_events_of_spans(machine, log) for log in read]
    told = lambda log, e: not (e.signal == "torque" and set(e.joints) <= set(log.unused))  # noqa: E731
    found = [
        replace(log, events=tuple(e for s in log.segments for e in events.find(s, machine.joints, log=log.name, among=among) if told(log, e))) for log in read
    ]  # fmt: skip
    felt = bumps(machine, found, among=among)
    more = [[e for e in felt if e.log == log.name] for log in found]
    return [replace(log, events=events.ordered([*log.events, *own])) if own else log for log, own in zip(found, more)]


def _with_events_of_spans(machine: Robot, log: logs.Log) -> logs.Log:
    found, step = [], 0.0
    for number in range(len(log.segments)):
        released()
        span = log.segments.around(number, _BESIDE)
        (own,) = with_events(machine, [replace(log, segments=(replace(span, core=None),))], among=len(log.segments))
        found += events.clipped(own.events, *span.t[[span.core.start, span.core.stop - 1]])
        step = span.step
    return replace(log, events=events.joined(found, step))


@dataclass(frozen=True)
class Read:
    """An experiment's logs, read once for all who look at them, and what there was to say of them."""

    train: list[logs.Log]
    test: list[logs.Log]
    notices: tuple[str, ...]


def read_all(experiment: Experiment) -> Read:
    """The training and the test logs of an experiment. Raises SysidError."""
    machine = robot.load(experiment.robot, experiment.folder)
    with noticed() as notices:
        parts = [read(experiment, machine, part) for part in (experiment.data.train, experiment.data.test)]
    return Read(*parts, tuple(notices))


@single_threaded
def fit(
    experiment: Experiment, *, filters: dict | None = None, strength: PriorWeight | None = None, progress: Progress | None = None, measured: Read | None = None,
    workers: int = 1, scheduler: str | None = None,
) -> Fit:
    """Identify an experiment: everything from its logs to its errors on held-out data.

    Args:
        filters, strength: what an earlier fit of the same logs chose, `Fit.filters` and `Fit.strength`; by default filters
            are compared again, and the weight of the prior is chosen where the experiment says so.
        measured: its logs, where they are at hand.
        workers, scheduler: as of `workers.crew`: who reads, filters, compresses and predicts. What is found does not depend on it.

    Raises:
        SysidError: bad input, with the one line that says so. A search that does not converge does not raise; it
            is `fit.solution.converged`.
    """
    tell = progress or (lambda stage, share: None)
    if workers == 1 and scheduler is None:
        return _fit(experiment, filters, strength, tell, measured, None)
    with crew(workers, scheduler, lambda text: tell(text, 0.0)) as mapped:
        return _fit(experiment, filters, strength, tell, measured, mapped)


def _fit(experiment: Experiment, filters: dict | None, strength: PriorWeight | None, tell: Progress, measured: Read | None, mapped: Mapped | None) -> Fit:
    experiment = experiment if strength is None else with_weight(experiment, strength.value)
    seconds: dict[str, float] = {}
    with noticed() as notices:
        experiment = started(experiment)
        with _timed(seconds, "robot", tell):
            machine, structure, prior = build(experiment)
        for text in measured.notices if measured else ():
            warnings.warn(SysidWarning(text), stacklevel=2)
        with _timed(seconds, "read", tell):
            train = measured.train if measured else read(experiment, machine, experiment.data.train, structure=structure, mapped=mapped)
        _refuse_no_torque(train)
        provenance = [_provenance("train", log, spec) for log, spec in zip(train, experiment.data.train)]
        with _timed(seconds, "filters", tell):
            chosen = filtering.compare(experiment, structure, train, prior, progress=lambda share: tell("filters", share)) if filters is None else filters
            preprocess = filtering.settled(experiment.preprocess, chosen)
        with _timed(seconds, "preprocess", tell):
            motion = prepare(train, preprocess, machine.joints, mapped)
            del train  # the filtered motion holds all that is needed from here on
        _tell_still(motion)
        _tell_left_out(motion, preprocess)
        disturbed = _tell_events("train", motion)
        with _timed(seconds, "shape", tell):
            structure, slopes, searched, weight = _settled(experiment, structure, motion, prior)
        with _timed(seconds, "compress", tell):  # the regressor is built and reduced chunk by chunk, never whole
            compressed = compress(slopes or structure, motion, progress=lambda share: tell("compress", share))
        with _timed(seconds, "weight", tell):
            weight = weight or _strength(experiment, structure, motion, compressed, prior)
        with _timed(seconds, "solve", tell):
            found = identify(with_weight(experiment, weight.value), structure, motion, compressed, prior)
            found = replace(found, strength=strength or weight)
        if not found.physically_consistent:
            names = [body.name for body, possible in zip(machine.bodies, is_consistent(found.pi)) if not possible]
            warnings.warn(SysidWarning(f"impossible bodies: {', '.join(names)}; identified.urdf will not serve a simulator. model.inertia: log-cholesky keeps them possible"), stacklevel=2)
        _tell_undetermined(found, motion)
        with _timed(seconds, "masses", tell):  # what other fits are compared with has been asked what it lacks
            heavy = masses.implausible(found, motion if filters is None else None)
        if heavy is not None:
            warnings.warn(SysidWarning(heavy.says), stacklevel=2)
        with _timed(seconds, "predict", tell):
            predictions = {"train": predicted(structure, found.x, motion)}
            samples, left_out = {"train": motion.samples}, {"train": _left_out(motion)}
            del motion
        with _timed(seconds, "test", tell):
            held_out = measured.test if measured else read(experiment, machine, experiment.data.test, structure=structure, mapped=mapped)
            provenance += [_provenance("test", log, spec) for log, spec in zip(held_out, experiment.data.test)]
            _tell_overlap(experiment, provenance)
            motion = prepare(held_out, preprocess, machine.joints, mapped)
            del held_out
            disturbed += _tell_events("test", motion)
            predictions["test"] = predicted(structure, found.x, motion)
            samples["test"], left_out["test"] = motion.samples, _left_out(motion)
            told = drives.found(experiment, structure, found.x, found.uncertainty.std, found.shape_std)
            let_go = rollout.rms(experiment, structure, found.x, motion)
        if not scale_is_told(experiment, machine.joints):
            warnings.warn(SysidWarning("no joint's torque is known in N m: these logs tell masses, friction and gains up to one common factor, which the prior's masses choose; one known gain, or a payload of known mass, settles it"), stacklevel=2)
        tell("left", 0.0)
        for text in implausible(replace(found, predictions=predictions)):
            warnings.warn(SysidWarning(text), stacklevel=2)
    return replace(
        found, masses=masses.document(heavy), predictions=predictions, samples=samples, left_out=left_out, seconds=seconds, filters=chosen,
        logs=tuple(provenance), notices=tuple(notices), events=tuple(disturbed), drives=tuple(told), rollout=let_go, searched=searched,
    )  # fmt: skip


def refit(experiment: Experiment, before: Fit, *, filters: dict | None = None, **how) -> tuple[Fit, Fit]:
    """Fit an experiment that grew from a fitted one: as its file says, and under that one's prior, by which the two are compared.

    Where the weight of the prior is chosen, what was missing before may let it be another: the second fit is the first
    where it is the same.

    Args:
        filters, how: as of `fit`.
    """
    if before.strength.auto:
        experiment = with_weight(experiment, AUTO)
    after = fit(experiment, filters=filters, **how)
    if after.strength.value == before.strength.value:
        return after, after
    return after, fit(experiment, filters=after.filters, strength=before.strength, **how)


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


@dataclass(frozen=True)
class Prepared:
    """What studies work on: an experiment, the weight of its prior a number, its logs as triangles, with the model, the
    prior (bodies, 10), and which coefficients (coefficients,) belong to joints that move."""

    experiment: Experiment
    model: Model
    motion: Motion
    train: Compressed
    test: Compressed
    prior: np.ndarray
    moving: np.ndarray
    notices: tuple[str, ...]


def prepared(experiment: Experiment) -> Prepared:
    """Read, filter and compress the training and the test logs of an experiment. Raises SysidError."""
    with noticed() as notices:
        experiment = started(experiment)
        machine, structure, prior = build(experiment)
        train = read(experiment, machine, experiment.data.train)
        _refuse_no_torque(train)
        preprocess = experiment.preprocess
        if _automatic(experiment):
            preprocess = filtering.settled(preprocess, filtering.compare(experiment, structure, train, prior))
        motion = prepare(train, preprocess, machine.joints)
        _tell_still(motion)
        structure, _, _, strength = _settled(experiment, structure, motion, prior)
        held_out = prepare(read(experiment, machine, experiment.data.test), preprocess, machine.joints)
        train_data, test_data = compress(structure, motion), compress(structure, held_out)
        strength = strength or _strength(experiment, structure, motion, train_data, prior)
    return Prepared(with_weight(experiment, strength.value), structure, motion, train_data, test_data, prior, moving_coefficients(structure, motion), tuple(notices))


_PASSES, _NEAR = 3, 0.1  # refinements on all rows; of a standard deviation
_ROUNDS = 3  # of a prior's weight and the shape values under it


def _settled(experiment: Experiment, structure: Model, motion: Motion, prior) -> tuple[Model, Linearised | None, tuple[Searched, ...], PriorWeight | None]:
    """The model measured by a motion, its shape values found: on rows that fit in memory, then by Gauss-Newton steps on all
    of them. Its slopes there, None where no shape value is free, and what was done to find them. And the prior's weight, None
    where it had no part in it."""
    structure = finite(structure.measured_by(motion), motion)
    if not (structure.shape_values or structure.uses_load):
        return structure, None, (), None
    strength = None
    if is_auto(experiment):
        begun = Linearised(structure, np.append(prior.ravel(), np.zeros(len(structure.coefficients))))
        strength = _strength(experiment, structure, motion, compress(begun if structure.gains else structure, motion), prior)
    weighed = experiment if strength is None else with_weight(experiment, strength.value)
    found = shape.settle(weighed, structure, motion, prior, profile=True)
    bodies, searched = found.x[: 10 * structure.bodies].reshape(-1, 10), found.searched
    if (scaled := rescaled(found.model, weighed, bodies, prior)) is not found.model:
        found = shape.settle(weighed, scaled, motion, prior, grid=False)
    structure, slopes = found.model, Linearised(found.model, found.x)
    if not slopes.free:
        return structure, None, searched, None
    best = None
    for number in range(_PASSES):
        try:
            data = compress(slopes, motion)
        except NotFinite:
            if best is None:
                raise
            return best[1], best[2], searched, best[3]  # of a formula, the last step left its domain
        for _ in range(_ROUNDS if number == 0 else 0):  # what was missing before is in the model now
            before, strength = strength, _strength(experiment, structure, motion, data, prior, strength)
            weighed = with_weight(experiment, strength.value)
            if before is None or before.value == strength.value:
                break
            again = shape.settle(weighed, structure, motion, prior, grid=False, profile=True)
            searched = tuple(one.checked_again(other) for one, other in zip(searched, again.searched))
            structure, slopes = again.model, Linearised(again.model, again.x)
            data = compress(slopes, motion)
        fit = identify(weighed, structure, motion, data, prior, near=slopes.x)
        # blows make valleys narrower than a step, and slopes say little at a corner: the last step is taken back
        if best is not None and (structure.deflects or not structure.uses_load) and fit.objective > best[0]:
            return best[1], best[2], searched, best[3]
        best = fit.objective, structure, slopes, strength
        change = shape.correction(fit, data)
        values = np.array(structure.shapes)
        low, high = (np.array([getattr(v, end) for v in structure.shape_values]) for end in ("low", "high"))
        values[slopes.free] += change
        structure = structure.with_shapes(np.clip(values, low, high))
        if structure.uses_load:
            structure = structure.with_reference(fit.pi)
        slopes = Linearised(structure, fit.x)
        std = fit.shape_std[slopes.free]
        if not np.any(np.abs(change) > _NEAR * np.where(np.isfinite(std), std, np.inf)):
            break
    return structure, slopes, searched, strength


def _strength(experiment: Experiment, structure: Model, motion: Motion, data: Compressed, prior, before: PriorWeight | None = None) -> PriorWeight:
    """The weight of the prior on training data, which may hold slopes of shape values after the model's own parameters.

    Gains are found anew on what is held apart, to first order: what a gain is and what the bodies weigh is one product, and
    gains that a strong prior chose would let no other weight be better.

    Args:
        before: what was chosen for the model before its shape values were found.
    """
    if not is_auto(experiment):
        return PriorWeight(experiment.prior.weight)
    if data.size > structure.size:
        free = [k for k, value in enumerate(structure.shape_values) if not value.held]
        data = data.only([*range(structure.size), *(structure.size + at for at, k in enumerate(free) if k in structure.gains)])
    return held_apart.chosen(experiment, structure, data, moving_coefficients(structure, motion), prior, before)


def _tell_undetermined(found: Fit, motion: Motion) -> None:
    structure = found.model
    moving = moving_coefficients(structure, motion)
    of_level = [c.at is not None and structure.robot.joints[c.joint] not in motion.still for c in structure.coefficients]
    names = [c.name for c, held, moves, own in zip(structure.coefficients, found.held, moving, of_level) if held and (moves or own)]
    names += [v.name for v, std in zip(structure.shape_values, found.shape_std) if not (v.held or np.isfinite(std))]
    if names:
        warnings.warn(SysidWarning(f"this log cannot tell {', '.join(names)} from the rest of the model: held at the prior"), stacklevel=2)


def _automatic(experiment: Experiment) -> bool:
    return "auto" in (experiment.preprocess.window, experiment.preprocess.cutoff)


def _prior(experiment: Experiment, structure: Model) -> np.ndarray:
    """The prior bodies: the URDF's, or those of a previous fit where it has them."""
    source = experiment.prior.source
    if source == "urdf":
        return np.array(structure.robot.prior)
    from .results import read_inertias

    return read_inertias((experiment.folder / source).resolve(), structure)


# Of a joint that moves through its reversals, a few per cent of the rows are slow; more means that it was held.
_MUCH_STANDING = 0.1


_NO_TORQUE = 1e-12  # N m: no robot is moved by less


def _refuse_no_torque(train: list[logs.Log]) -> None:
    if not any(np.abs(segment.tau).max(initial=0.0) >= _NO_TORQUE for log in train for segment in log.segments):
        raise LogError("the torque of every joint is 0 in every row: none was logged", where=str(train[0].path), do="name the columns of torque in data.columns.torque, or what drives the joints in actuator")


def _tell_still(motion: Motion) -> None:
    for joint, share in zip(motion.joints, motion.standing):
        if share > _MUCH_STANDING and joint not in motion.still:
            warnings.warn(SysidWarning(f"joint {joint!r} stands still in {100 * share:.0f} % of its rows, where its friction may have any value up to its greatest; preprocess.standstill: auto leaves them out"), stacklevel=2)
    for joint in motion.still:
        warnings.warn(SysidWarning(f"joint {joint!r} never moves in the training logs, or never clear of a standstill; its friction is held at its prior, and its bodies are where the other joints' torque leaves them"), stacklevel=2)


def _tell_left_out(motion: Motion, spec) -> None:
    shares = [f"{joint} {100 * count / motion.samples:.0f} %" for joint, count in zip(motion.joints, motion.left_out) if count and joint not in motion.unused]
    if spec.standstill == "auto" and shares:
        warnings.warn(SysidWarning(f"rows around each joint's reversals and standstill, where the filter smears friction's jump, are left out of its fit and its error: {', '.join(shares)}; preprocess.standstill: keep uses every row"), stacklevel=2)


def _left_out(motion: Motion) -> dict[str, int]:
    return dict(zip(motion.joints, motion.left_out.tolist()))


def _tell_events(part: str, motion: Motion) -> list[dict]:
    """The events of a part as documents have them; the user is told."""
    for notice in events.told(motion.events, motion.disturbed, {"train": "training"}.get(part, part)):
        warnings.warn(SysidWarning(notice), stacklevel=2)
    return [{"part": part, "kind": e.kind, "log": e.log, "start": e.start, "stop": e.stop, "joints": list(e.joints), "signal": e.signal} for e in motion.events]


def _tell_overlap(experiment: Experiment, found: list[dict]) -> None:
    hashes = [set(log.get("files", {}).values()) or {log["sha256"]} for log in found]
    trained = list(zip(experiment.data.train, hashes))
    for test, own in zip(experiment.data.test, hashes[len(trained) :]):
        for train, other in trained:
            if not logs.overlapping(test, own, train, other):
                continue
            if own == other and test.name != train.name:
                warnings.warn(SysidWarning(f"test log {test.name} is the training log {train.name} under another name; its error is not held out"), stacklevel=2)
            else:
                warnings.warn(SysidWarning(f"test log {test.name} overlaps a training log; its error is not held out"), stacklevel=2)


def _provenance(part: str, log: logs.Log, spec: LogSpec) -> dict:
    chosen = {key: value for key in ("topic", "episode") if (value := getattr(spec, key)) is not None}
    return {
        "part": part, "log": log.name, "sha256": log.sha256, "start": spec.start, "stop": spec.stop,
        "samples": log.samples, "segments": log.stretches, **chosen, **({"files": log.hashes} if len(log.hashes) > 1 else {}),
    }  # fmt: skip


@contextmanager
def noticed():
    """Collect what was decided for the user, each once, as text; other warnings go on as what they are."""
    notices: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", SysidWarning)
        yield notices
    for warning in caught:
        if not issubclass(warning.category, SysidWarning):
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
        elif str(warning.message) not in notices:
            notices.append(str(warning.message))


@contextmanager
def _timed(seconds: dict[str, float], stage: str, tell: Progress):
    start = time.perf_counter()
    tell(stage, 0.0)
    yield
    seconds[stage] = time.perf_counter() - start


__all__ = ["Read", "build", "fit", "load", "predict_log", "prepared", "read", "read_all", "refit"]
