"""A run's model and a new log -> what is different on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .. import datasets, pipeline, rows
from ..blocks import numbered
from ..errors import LogError
from ..lowpass import LEAST, lowpassed, stride_of
from ..noise import floors_of
from ..specs import Experiment, LogSpec
from .fitted import Change, together
from .halves import BLOCKS, Question
from .held import held
from .signatures import signatures


@dataclass(frozen=True)
class Changed:
    """What is different on a log: RMS [N m] per joint of the held model and with the changes, the
    noise floor, the changes, and what had no visible signature. notes: what to know of the
    numbers."""

    joints: tuple[str, ...]
    rms_held: np.ndarray
    rms_after: np.ndarray
    floors: tuple
    changes: tuple[Change, ...]
    notes: tuple[str, ...]


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
    structure, x = held(run, experiment, levels or {})
    robot = structure.robot
    specs = [LogSpec(file=_located(log)) for log in logs]
    with pipeline.noticed():
        motion = lowpassed(pipeline.read(experiment, robot, specs), robot.joints, LEAST)
    if motion is None or motion.duration < 4.0:
        raise LogError(
            "the log is too short to say what changed", where=", ".join(logs),
            allowed="4 s or more of motion", do="give a longer log",
        )  # fmt: skip
    structure = structure.scaled_by(motion)
    stride = stride_of(motion, LEAST)
    data = rows.stack(structure, motion, stride)
    residual = data.residual(x)
    by_size = lambda left: 1.0 / np.maximum(data.rms(left), 1e-12)  # noqa: E731
    blocks = numbered(data.t, data.piece, shortest=np.inf, fewest=BLOCKS)
    tried = signatures(structure, x, motion, stride, data.use)
    tried = {key: columns for key, columns in tried.items() if np.any(columns)}
    question = Question(tried, residual, by_size(residual), blocks)
    chosen = question.supported()
    changes, after = together(structure, question, chosen)
    if changes:  # a joint counts by what is left of it, not by what the changes made of it
        question = replace(question, weights=by_size(after))
        changes, after = together(structure, question, question.supported() or chosen)
    count = 10 * structure.bodies
    bodies, rest = x[:count].reshape(-1, 10), x[count:]
    predicted = np.concatenate([structure.torque(piece, bodies, rest) for piece in motion.pieces])
    found = floors_of(motion.pieces, predicted)
    notes = _notes(experiment, changes)
    return Changed(robot.joints, data.rms(residual), data.rms(after), found, changes, notes)


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
