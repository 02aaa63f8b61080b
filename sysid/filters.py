"""Which filter? Compared on held-out stretches of the training logs, never on the test logs.

Robots differ in sampling, encoder and motion, and the filter moves the error more than most effects do. So every
fit states what the chosen filter gives and what its neighbours would have given, against the torque as logged
(a filter that also smooths the torque must not be judged by its own smoothing).
"""

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from . import interior
from .compress import Compressed, compress
from .config import Experiment, PreprocessSpec
from .errors import SysidError, SysidWarning
from .estimate import pose
from .log import Log
from .model import Model, moving_coefficients
from .preprocess import prepare

_WINDOWS = (0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8)  # s
_CUTOFFS = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0)  # Hz
_FOLDS = 4
# Enough to rank filters; a long log need not be read whole for it.
_MOST_SAMPLES, _ROWS = 30_000, 5_000


def compare(experiment: Experiment, model: Model, logs: Sequence[Log], prior) -> dict:
    """The chosen filter and its neighbours with their held-out errors.

    Returns:
        {"filter", "order", "window" or "cutoff", "torque", "chosen": "given" or "held-out error", "held_out": [
        {"window" or "cutoff": value, "relative_error": share, "rms": {joint: N m}}, ...]}; neighbours are half and
        double the value where it was given, the whole grid where it was `auto`.
    """
    spec = experiment.preprocess
    said = {"filter": spec.filter, "torque": spec.torque, "standstill": spec.standstill}
    if spec.filter == "none":
        return {**said, "chosen": "given", "held_out": []}
    key = "window" if spec.filter == "savitzky-golay" else "cutoff"
    value = getattr(spec, key)
    automatic = value == "auto"
    candidates = (_WINDOWS if key == "window" else _CUTOFFS) if automatic else (value / 2, value, value * 2)
    shortened = [_middle(log) for log in logs]
    tried = []
    for candidate in candidates:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", SysidWarning)
                tried.append({key: candidate, **_held_out(experiment, spec.model_copy(update={key: candidate}), model, shortened, prior)})
        except SysidError:
            continue  # a window shorter than its order, a cutoff above half the sampling rate: no candidate
    if automatic:
        if not tried:
            raise SysidError(f"no {key} suits the logs", where="preprocess", do=f"give {key} a number")
        value = min(tried, key=lambda entry: entry["relative_error"])[key]
        place = [entry[key] for entry in tried].index(value)
        if len(tried) > 1 and place in (0, len(tried) - 1):
            warnings.warn(SysidWarning(f"preprocess.{key}: auto chose {value:g}, the end of what was tried; give a number to go further"), stacklevel=2)
    return {**said, "order": spec.order, key: value, "chosen": "held-out error" if automatic else "given", "held_out": tried}


def settled(spec: PreprocessSpec, chosen: dict) -> PreprocessSpec:
    """The preprocessing with `auto` replaced by what was chosen."""
    return spec.model_copy(update={key: chosen[key] for key in ("window", "cutoff") if key in chosen})


def _middle(log: Log) -> Log:
    """The longest segment's middle, of at most `_MOST_SAMPLES`."""
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


def _held_out(experiment: Experiment, spec: PreprocessSpec, model: Model, logs, prior) -> dict:
    motion = prepare(logs, spec, model.robot.joints)
    # against the torque as logged, over every row: what a filter smooths away or masks it has not explained
    raw = replace(motion, pieces=tuple(replace(piece, tau=piece.measured, use=None) for piece in motion.pieces))
    thin = max(1, motion.samples // _ROWS)
    data = compress(model, motion, thin=thin)
    target = data if spec.torque == "raw" and spec.standstill == "keep" else compress(model, raw, thin=thin)
    moving = moving_coefficients(model, motion)
    folds = np.array_split(np.arange(data.blocks), min(_FOLDS, data.blocks))
    squares, rows = np.zeros(model.robot.dof), np.zeros(model.robot.dof)
    if len(folds) < 2:
        raise SysidError("the log is too short to hold a part of it out", where="preprocess")
    for fold in folds:
        kept = data.without(fold)
        problem = pose(experiment, model, kept, moving, prior)
        iterates, _ = interior.minimise(
            problem.objective, problem.coordinates.positive, problem.coordinates.held, problem.coordinates.physical(problem.start),
            tolerance=experiment.solver.tolerance,
        )  # fmt: skip
        held = _only(target, fold)
        squares += held.squares(iterates[-1])
        rows += held.rows
    size = sum(float(np.sum(factor.triangle[:, -1] ** 2)) for factor in target.by_joint)
    rms = np.sqrt(squares / np.maximum(rows, 1))
    return {"relative_error": float(np.sqrt(squares.sum() / size)), "rms": dict(zip(model.robot.joints, rms.tolist()))}


def _only(data: Compressed, blocks) -> Compressed:
    return data.without(set(range(data.blocks)) - set(blocks))
