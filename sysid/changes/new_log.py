"""A run's model and a new log -> what is different on it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .. import datasets, experiment_logs, rows
from ..blocks import numbered
from ..errors import LogError, SysidError
from ..log_spec import LogSpec
from ..lowpass import LEAST, lowpassed, stride_of
from ..model import Model
from ..model_parameters import ROBOT
from ..motion import Motion
from ..noise import floors_of
from ..preprocess import prepare
from ..spans import Spans
from ..specs import Experiment
from ..warned import noticed
from .fitted import Change, together, with_fewer
from .halves import BLOCKS, Key, support
from .halves import question as asked_of
from .hands import PAYLOAD, hands, holding
from .held import Held, held
from .signatures import OFFSET, TILT, about, bent, near

RATE = 0.05
_SAME = 1e-4  # of a column's square, a hundredth of it: what the other leaves
_ROUNDS, _NEAR = 5, 1e-4  # about a tilt or an offset; rad: what rounds may still change of it


@dataclass(frozen=True)
class Changed:
    """What is different on a log: RMS [N m or N] per joint of the held model and with the changes,
    under the low-pass; the changes. floors, left: of the torque as logged the noise floor and what
    the model with the changes leaves, where they were asked for. notes: what to know of the
    numbers."""

    joints: tuple[str, ...]
    rms_held: np.ndarray
    rms_after: np.ndarray
    floors: tuple
    changes: tuple[Change, ...]
    notes: tuple[str, ...]
    left: np.ndarray | None = None


def changed(
    experiment: Experiment, run: Path, logs: list[str], levels: Mapping[str, str] | None = None
) -> Changed:  # fmt: skip
    """What is different on logs, with a run's model held.

    Args:
        logs: file names relative to the working directory, or names of public logs.

        levels: {group: level} of the logs, of every group that effects of the run are per.

    Raises:
        SysidError: no such run, log or level, or a log too short to be split in halves.
    """
    return asked(held(run, experiment, levels), logs, floors=True)


def asked(
    model: Held, logs: list[str], *, floors: bool = False, rate: float = RATE, among: int = 1
) -> Changed:  # fmt: skip
    """What is different on logs, with a model held.

    Args:
        logs: as of `changed`. floors: whether the noise floors are asked for too, which costs as
            much as all else; without them there are none.
        rate: of false alarms among so many logs like this one.

    Raises:
        SysidError: no such log, or one too short to be split in halves.
    """
    experiment, x, robot = model.experiment, model.x, model.model.robot
    specs = [LogSpec(file=_located(log)) for log in logs]
    with noticed():
        read = experiment_logs.read(experiment, robot, specs)
        motion = lowpassed(read, robot.joints, LEAST)
    if motion is None or motion.duration < 4.0:
        raise LogError(
            "the log is too short to say what changed", where=", ".join(logs),
            allowed="4 s or more of motion", do="give a longer log",
        )  # fmt: skip
    structure = model.model.scaled_by(motion)
    stride = stride_of(motion, LEAST)
    data = rows.measured(motion, stride)
    counted = np.maximum(data.use.sum(axis=0), 1)
    by_size = lambda squares: 1.0 / np.maximum(np.sqrt(squares / counted), 1e-12)  # noqa: E731
    blocks = numbered(data.t, data.piece, shortest=np.inf, fewest=BLOCKS)
    residual, tried = about(structure, x, motion, stride, data)
    squares = after = (residual**2).sum(axis=0)
    hand = holding(structure, motion, stride, data.use, residual, by_size(after), blocks)
    if hand:
        residual, tried = about(structure, x, motion, stride, data, hand=hand)
    questions = len(tried) + len(hands(robot)) - 1
    changes, at, few = (), {}, bent(structure)
    for _ in range(_ROUNDS):  # what a tilt does bends with it
        question = asked_of(tried, residual, by_size(after), blocks)
        least = support(rate, among * questions)
        chosen = with_fewer(question, question.supported(least), few, least)
        changes, after = together(structure, question, chosen)
        if changes:  # a joint counts by what is left of it, not by what the changes made of it
            question = question.weighed(by_size(after))
            anew = with_fewer(question, question.supported(least), few, least)
            changes, after = together(structure, question, anew or chosen)
        before, at = at, near(structure, changes)
        same = at.keys() == before.keys()
        if same and all(np.abs(at[key] - before[key]).max() < _NEAR for key in at):
            break
        residual, tried = about(structure, x, motion, stride, data, at, hand)
    rms = [np.sqrt(own / counted) for own in (squares, after)]
    changes = tuple(replace(c, options=hand) if c.effect == PAYLOAD[0] else c for c in changes)
    said = changes, (*_notes(experiment, changes), *_twins(robot, tried, changes))
    if not floors:
        return Changed(robot.joints, *rms, (), *said)
    found, whole = _as_logged(structure, x, _as_fitted(model, read) or motion)
    # what is as slow as motion the low-pass leaves as it is
    left = np.sqrt(np.maximum(whole - (rms[0] ** 2 - rms[1] ** 2), 0.0))
    return Changed(robot.joints, *rms, found, *said, left)


def _as_fitted(model: Held, read) -> Motion | None:
    """Logs with torque as logged, seen as the run's own fit saw them: under another filter the
    noise of the angles makes another error. None where they are too short for that, or fill the
    memory."""
    if any(isinstance(log.segments, Spans) for log in read):
        return None
    raw = model.preprocess.model_copy(update={"torque": "raw"})
    try:
        with noticed():
            return prepare(read, raw, model.model.robot.joints)
    except SysidError:
        return None


def _as_logged(structure: Model, x, motion) -> tuple[tuple, np.ndarray]:
    """The noise floor of each joint's torque as logged, and what the model leaves of it (dof,)."""
    first = 10 * structure.bodies
    bodies, rest = x[:first].reshape(-1, 10), x[first:]
    predicted = [structure.torque(piece, bodies, rest) for piece in motion.pieces]
    squares = count = np.zeros(len(motion.joints))
    for piece, told in zip(motion.pieces, predicted):
        use = 1.0 if piece.use is None else piece.use[piece.core]
        squares = squares + np.sum((piece.measured[piece.core] - told) ** 2 * use, axis=0)
        count = count + np.sum(np.ones(told.shape) * use, axis=0)
    return floors_of(motion.pieces, np.concatenate(predicted)), squares / np.maximum(count, 1)


def _twins(robot, tried: Mapping[Key, np.ndarray], changes) -> Iterator[str]:
    """The encoders whose offset is the same as a change: as a tilt, of a first joint whose axis is
    level; as a load, of the joint of its link."""
    found, told = {c.effect for c in changes}, {(c.effect, c.joint) for c in changes}
    for key, what in ((TILT, ROBOT), "a tilt of the base"), (PAYLOAD, "a load on its link"):
        if key[0] not in found:
            continue
        wide = tried[key].reshape(-1, tried[key].shape[2])
        for (name, joint), columns in tried.items():
            if name != OFFSET or (name, robot.joints[joint]) in told:
                continue
            own = columns.reshape(len(wide), -1)[:, 0]
            left = own - wide @ np.linalg.lstsq(wide, own, rcond=None)[0]
            if left @ left < _SAME * (own @ own):
                where = robot.joints[joint]
                yield f"here an offset of the encoder of {where} is the same as {what}"


def _located(log: str) -> str:
    return log if datasets.reference(log) is not None else str(Path(log).resolve())


def _notes(experiment: Experiment, changes) -> tuple[str, ...]:
    out = []
    if any(change.effect == "payload" for change in changes):
        if experiment.data.units.torque == "A":
            out.append(
                "the payload's mass is proportional to the torque constants: were all of them 10 % "
                "larger, it would be 10 % larger, and nothing in these logs can tell"
            )
        else:
            out.append("the payload's mass is proportional to the torque sensors' gain")
    if any(change.effect == "torque_bias" for change in changes) and any(
        change.effect == "payload" for change in changes
    ):
        out.append(
            "a bias and a payload were told apart by the poses of this log alone; a pose held at "
            "rest would say more"
        )
    return tuple(out)
