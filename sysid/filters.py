"""Which filter? Compared on held-out stretches of the training logs, never on the test logs.

Robots differ in sampling, encoder and motion, and the filter moves the error more than most effects do. So every
fit states what the chosen filter gives and what its neighbours would have given, against the torque as logged
(a filter that also smooths the torque must not be judged by its own smoothing). Joints count by the logarithm of their error, as the
likelihood of noise has it whose size nobody knows: in a sum of squares a shoulder would choose the filter of a wrist.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from . import interior
from .blocks import within_one_error
from .compress import compress
from .drives import slowest
from .errors import SysidError, SysidWarning
from .events import usable
from .log import Log
from .lowpass import band
from .model import Model, moving_coefficients
from .multistart import finite
from .posed_problem import pose
from .preprocess import prepare
from .smoother import Smoother
from .spans import Spans
from .specs import Experiment, PreprocessSpec
from .triangles import Compressed

_WINDOWS = (0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8)  # s
_CUTOFFS = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0)  # Hz
_FOLDS = 4
# Windows of an angle, a cycle of the low-pass on both sides. A polynomial of order 4 is -3 dB at 1.56 / window: friction's jump is smeared
# over a short time only, and the noise that comes through stays behind the low-pass.
_ANGLES, _POSES = 12.0, 50
# Enough to rank filters; a long log need not be read whole for it.
_MOST_SAMPLES, _ROWS = 30_000, 5_000
_EXACT = 1e-16  # squared relative error: less is rounding


def compare(
    experiment: Experiment, model: Model, logs: Sequence[Log], prior, *, progress: Callable[[float], None] | None = None
) -> dict:  # fmt: skip
    """The chosen filter and its neighbours with their held-out errors.

    Args:
        progress: called with the share of them that is done.

    Returns:
        {"filter", "order", "window" or "cutoff", "torque", "chosen": "given" or "held-out error", "held_out": [
        {"window" or "cutoff": value, "relative_error": geometric mean over the joints, "rms": {joint: N m}}, ...]}; neighbours are half and
        double the value where it was given, the whole grid where it was `auto`.
    """
    spec = experiment.preprocess
    if lowpassed(experiment):
        return _of_the_motion(experiment, model, logs, prior)
    said = {"filter": spec.filter, "torque": spec.torque, "standstill": spec.standstill}
    if spec.filter == "none":
        return {**said, "chosen": "given", "held_out": []}
    key = "window" if spec.filter == "savitzky-golay" else "cutoff"
    value = getattr(spec, key)
    automatic = value == "auto"
    candidates = (_WINDOWS if key == "window" else _CUTOFFS) if automatic else (value / 2, value, value * 2)
    shortened = [_middle(log) for log in logs]
    edge, tried = _widest_edge(spec, key, candidates, shortened), []
    for number, candidate in enumerate(candidates):
        if progress:
            progress(number / len(candidates))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", SysidWarning)
                tried.append({key: candidate, **_held_out(experiment, spec.model_copy(update={key: candidate}), model, shortened, prior, edge)})
        except SysidError:
            continue  # a window shorter than its order, a cutoff above half the sampling rate: no candidate
    if automatic:
        if not tried:
            raise SysidError(f"no {key} suits the logs", where="preprocess", do=f"give {key} a number")
        value = _best(tried, key, 0.1 if key == "window" else 10.0)
        place = [entry[key] for entry in tried].index(value)
        if len(tried) > 1 and place in (0, len(tried) - 1):
            warnings.warn(SysidWarning(f"preprocess.{key}: auto chose {value:g}, the end of what was tried; give a number to go further"), stacklevel=2)
    shown = [{name: entry[name] for name in (key, "relative_error", "rms")} for entry in tried]
    return {**said, "order": spec.order, key: value, "chosen": "held-out error" if automatic else "given", "held_out": shown}


def lowpassed(experiment: Experiment) -> bool:
    """Whether both sides of an experiment go under a low-pass: where it says so, and where a joint's torque is made of its own angle, a
    servo's, and it says nothing of filters."""
    spec = experiment.preprocess
    servo = any(actuator.command is not None for actuator in experiment.actuator.values())
    return spec.filter != "none" and (spec.torque == "low-pass" or (servo and not spec.model_fields_set & {"filter", "window", "cutoff", "torque"}))


def _of_the_motion(experiment: Experiment, model: Model, logs: Sequence[Log], prior) -> dict:
    """The filters that a motion asks for: both sides as far as its joints' speeds go, or an octave beyond where its slowest servo swings,
    as from there on noise of the angles, which inertia makes torque of, grows with the square of frequency; the angles far beyond.
    """
    spec = experiment.preprocess
    own = {key for key in ("window", "cutoff") if key in spec.model_fields_set and getattr(spec, key) != "auto"}
    # of each, its step and angles thinned: a long one does not stand in memory
    thinned = [(len(s.t), s.step, s.q[:: -(-len(s.q) // _POSES)].copy()) for log in logs for s in log.segments]
    cutoff, step = spec.cutoff, max(step for _, step, _ in thinned)
    if "cutoff" not in own:
        rows, its_step, q = max(thinned, key=lambda one: one[0])
        cutoff = max(min(band(logs), 2.0 * slowest(experiment, model.robot, prior, q)), 1.0 / (its_step * rows))
    window = spec.window if "window" in own else max(1.0 / (_ANGLES * cutoff), 2.0 * (spec.order // 2) * step)
    return {
        "filter": spec.filter, "torque": "low-pass", "standstill": spec.standstill, "order": spec.order, "window": window, "cutoff": cutoff,
        "chosen": "given" if own == {"window", "cutoff"} else "the motion's band", "held_out": [],
    }  # fmt: skip


def _widest_edge(spec: PreprocessSpec, key: str, candidates, logs) -> float:
    """Seconds that every candidate leaves out at both ends of a log, so that all are judged on the same rows.

    A candidate that would take more than a tenth of the shortest log does not set it, and is judged on what it has.
    """
    shortest = min(segment.step * len(segment.t) for log in logs for segment in log.segments)
    edges = []
    for candidate in candidates:
        for log in logs:
            for segment in log.segments:
                try:
                    reach = Smoother(spec.model_copy(update={key: candidate}), segment.step).reach
                except SysidError:
                    continue
                edges.append(reach * segment.step * (2 if spec.torque == "same" else 1))
    return max((edge for edge in edges if edge <= 0.1 * shortest), default=0.0)


def _best(tried: list[dict], key: str, usual: float) -> float:
    """The candidate of least held-out error; among those within one standard error of it, the one nearest the usual."""
    least = min(tried, key=lambda entry: entry["relative_error"])
    # a candidate that is missing folds cannot be compared
    alike = [entry for entry in tried if len(entry["folds"]) == len(least["folds"])]
    kept = within_one_error([entry["folds"] for entry in alike], alike.index(least))
    tied = [entry[key] for entry, within in zip(alike, kept) if within]
    return min(tied, key=lambda value: abs(np.log(value / usual)))


def settled(spec: PreprocessSpec, chosen: dict) -> PreprocessSpec:
    """The preprocessing with `auto` replaced by what was chosen."""
    return spec.model_copy(update={key: chosen[key] for key in ("window", "cutoff", "torque") if key in chosen})


def torque_band(spec: PreprocessSpec) -> str:
    """What torque went through, on both sides of the equation: the band that errors are of, in words."""
    if spec.torque == "low-pass" and spec.filter != "none":
        return f"torque under a low-pass of {spec.cutoff:.3g} Hz"
    return "torque through the filter of the angles" if spec.torque == "same" and spec.filter != "none" else "torque as logged"


def _middle(log: Log) -> Log:
    """The longest segment's middle, of at most `_MOST_SAMPLES`."""
    if isinstance(log.segments, Spans):
        return replace(log, segments=(log.segments.middle(_MOST_SAMPLES),))
    segment = max(log.segments, key=lambda s: len(s.t))
    n = len(segment.t)
    if n <= _MOST_SAMPLES:
        return replace(log, segments=(segment,))
    rows = slice((n - _MOST_SAMPLES) // 2, (n + _MOST_SAMPLES) // 2)
    cut = lambda values: None if values is None else values[rows]  # noqa: E731
    part = replace(
        segment, t=segment.t[rows], q=segment.q[rows], tau=segment.tau[rows], qd=cut(segment.qd), qdd=cut(segment.qdd),
        signals={name: values[rows] for name, values in segment.signals.items()},
    )  # fmt: skip
    return replace(log, segments=(part,))


def _held_out(experiment: Experiment, spec: PreprocessSpec, model: Model, logs, prior, edge: float) -> dict:
    motion = prepare(logs, spec, model.robot.joints)
    model = finite(model.measured_by(motion), motion)
    motion = replace(motion, pieces=tuple(_trimmed(piece, logs[piece.log].segments[0], edge) for piece in motion.pieces))
    # against the torque as logged, over every row: what a filter smooths away or masks it has not explained
    # but for what disturbed the logs, as far as the widest candidate sees of it
    told = np.array([joint not in motion.unused for joint in model.robot.joints])

    def calm(piece):
        joints = model.robot.joints
        use = usable(piece.t, joints, logs[piece.log].events, angles=edge, torque=edge) if motion.events else None
        return use if told.all() else told & (np.ones(piece.q.shape, dtype=bool) if use is None else use)

    raw = replace(motion, pieces=tuple(replace(piece, tau=piece.measured, use=calm(piece)) for piece in motion.pieces))
    thin = max(1, motion.samples // _ROWS)
    data = compress(model, motion, thin=thin)
    target = data if spec.torque == "raw" and spec.standstill == "keep" and not motion.events else compress(model, raw, thin=thin)
    moving = moving_coefficients(model, motion)
    folds = data.stretches(_FOLDS)
    size = np.array([max(float(np.sum(f.triangle[:, -1] ** 2)), 1e-300) for f in target.by_joint]) / np.maximum(target.rows, 1)
    squares, rows, errors = np.zeros(model.robot.dof), np.zeros(model.robot.dof), []
    if len(folds) < 2:
        raise SysidError("the log is too short to hold a part of it out", where="preprocess")
    for fold in folds:
        kept = data.without(fold)
        problem = pose(experiment, model, kept, moving, prior)
        iterates, _, _ = interior.minimise(
            problem.objective, problem.coordinates.positive, problem.coordinates.held, problem.coordinates.physical(problem.start),
            tolerance=experiment.solver.tolerance,
        )  # fmt: skip
        held = _only(target, fold)
        own = held.squares(iterates[-1])
        squares += own
        rows += held.rows
        errors.append(_logarithm(own, size, held.rows))
    rms = np.sqrt(squares / np.maximum(rows, 1))
    relative = float(np.exp(0.5 * _logarithm(squares, size, rows)))
    return {"relative_error": relative, "rms": dict(zip(model.robot.joints, rms.tolist())), "folds": errors}


def _logarithm(squares: np.ndarray, size: np.ndarray, rows: np.ndarray) -> float:
    """The mean over the joints, as many rows as each has, of the logarithm of their squared error over that of their torque."""
    count = rows > 0
    error = squares[count] / rows[count] / size[count]
    return float(np.average(np.log(np.maximum(error, _EXACT)), weights=rows[count]))


def _trimmed(piece, segment, edge: float):
    """The piece with its core cut to what lies `edge` seconds inside its segment."""
    inside = np.flatnonzero((piece.t > segment.t[0] + edge - 0.5 * piece.step) & (piece.t < segment.t[-1] - edge + 0.5 * piece.step))
    start, stop = max(piece.core.start, int(inside[0])), min(piece.core.stop, int(inside[-1]) + 1)
    return replace(piece, core=slice(start, stop))


def _only(data: Compressed, blocks) -> Compressed:
    return data.without(set(range(data.blocks)) - set(blocks))
