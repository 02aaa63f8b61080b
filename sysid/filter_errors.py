"""What a filter leaves of held-out stretches of logs: the errors by which filters are compared."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .compress import compress
from .errors import SysidError
from .events import usable
from .log import Log
from .model import Model, moving_coefficients
from .multistart import finite
from .posed_problem import pose
from .prediction import predict
from .preprocess import prepare
from .specs import Experiment, PreprocessSpec
from .triangles import Compressed

_FOLDS = 4
_ROWS = 5_000  # enough to rank filters
_EXACT = 1e-16  # squared relative error: less is rounding


def held_out(experiment: Experiment, spec: PreprocessSpec, model: Model, logs: Sequence[Log], prior, edge: float) -> dict:
    """What a fit of a model to logs under a filter leaves of each stretch that it has not seen.

    Args:
        logs: of one segment each. prior: bodies (bodies, 10). edge: [s] that are left out at both ends of each.

    Returns:
        {"relative_error": geometric mean over the joints, "rms": {joint: N m or N}, "folds": logarithms of squared relative errors,
        "untold": how many coefficients of joints that move the rows that it leaves cannot tell}.

    Raises:
        SysidError: the filter cannot be, or the logs are too short to hold a part of them out.
    """
    model, motion, data, target, whole = _seen(spec, model, logs, edge)
    if spec.torque == "low-pass" and np.any((data.rows == 0) & (target.rows > 0)):
        raise SysidError("the filter leaves a joint no row", where="preprocess")
    moving = moving_coefficients(model, motion)
    # a part that the joints stood still in, or were braked, has no error
    folds = [fold for fold in data.stretches(_FOLDS) if _only(target, fold).rows.any()]
    size = np.array([max(float(np.sum(f.triangle[:, -1] ** 2)), 1e-300) for f in target.by_joint]) / np.maximum(target.rows, 1)
    counts = whole / np.maximum(target.rows, 1)
    squares, rows, errors = np.zeros(model.robot.dof), np.zeros(model.robot.dof), []
    if len(folds) < 2:
        raise SysidError("the log is too short to hold a part of it out", where="preprocess")
    for fold in folds:
        kept = data.without(fold)
        problem = pose(experiment, model, kept, moving, prior)
        held = _only(target, fold)
        own = held.squares(problem.minimum(experiment.solver.tolerance))
        squares += own
        rows += held.rows
        errors.append(_logarithm(own, size, held.rows, counts))
    rms = np.sqrt(squares / np.maximum(rows, 1))
    relative = float(np.exp(0.5 * _logarithm(squares, size, rows, counts)))
    untold = int(np.sum(pose(experiment, model, data, moving, prior).coordinates.held & moving))
    return {"relative_error": relative, "rms": dict(zip(model.robot.joints, rms.tolist())), "folds": errors, "untold": untold}


def made_by_noise(
    experiment: Experiment, spec: PreprocessSpec, wide: PreprocessSpec, model: Model, logs: Sequence[Log], noisy: Sequence[Log], prior, edge: float
) -> dict:  # fmt: skip
    """{joint: mean square [(N m)² or N²]} of what the noise of the angles, once more, adds to the torque that is predicted behind a filter,
    by the parameters that logs tell behind a wider one: noise that comes through bends those behind the filter itself.

    Args:
        logs, prior, edge: as of `held_out`. noisy: logs with the noise of their angles once more.

    Raises:
        SysidError: as `held_out`.
    """
    seen, motion, data, *_ = _seen(wide, model, logs, edge)
    x = pose(experiment, seen, data, moving_coefficients(seen, motion), prior).minimum(experiment.solver.tolerance)
    told = [predict(model, x, motion).predicted for model, motion, *_ in (_seen(spec, model, each, edge) for each in (logs, noisy))]
    return dict(zip(model.robot.joints, np.mean((told[1] - told[0]) ** 2, axis=0).tolist()))


def _seen(spec: PreprocessSpec, model: Model, logs: Sequence[Log], edge: float):
    """What logs are behind a filter: the model, the motion, what a fit of it is given, what it is held against, and how many rows (dof,)
    that has."""
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
    # a wider filter leaves fewer rows of a joint whose effects jump: it counts no less for that
    whole = sum(np.sum(np.ones(p.q.shape, dtype=bool)[p.core] if p.use is None else p.use[p.core], axis=0) for p in raw.pieces)
    return model, motion, data, target, whole


def _logarithm(squares: np.ndarray, size: np.ndarray, rows: np.ndarray, counts: np.ndarray) -> float:
    """The mean over the joints, each by its rows times what one of them `counts`, of the logarithm of their squared error over that
    of their torque."""
    count = rows > 0
    error = squares[count] / rows[count] / size[count]
    return float(np.average(np.log(np.maximum(error, _EXACT)), weights=(rows * counts)[count]))


def _trimmed(piece, segment, edge: float):
    """The piece with its core cut to what lies `edge` seconds inside its segment."""
    inside = np.flatnonzero((piece.t > segment.t[0] + edge - 0.5 * piece.step) & (piece.t < segment.t[-1] - edge + 0.5 * piece.step))
    start, stop = max(piece.core.start, int(inside[0])), min(piece.core.stop, int(inside[-1]) + 1)
    return replace(piece, core=slice(start, stop))


def _only(data: Compressed, blocks) -> Compressed:
    return data.without(set(range(data.blocks)) - set(blocks))
