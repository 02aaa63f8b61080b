"""What was decided for the user on the way of a fit, in sentences, and how these are collected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import events
from . import log as logs
from .errors import LogError
from .estimate import Fit
from .model import moving_coefficients
from .motion import Motion
from .same_samples import NOT_HELD_OUT, Sampled, same, sampled, told
from .spans import Spans
from .specs import Experiment
from .warned import warn


def tell_undetermined(found: Fit, motion: Motion) -> None:
    """What these logs cannot tell from the rest of the model."""
    structure = found.model
    moving = moving_coefficients(structure, motion)
    of_level = [c.at is not None and structure.robot.joints[c.joint] not in motion.still for c in structure.coefficients]
    names = [c.name for c, held, moves, own in zip(structure.coefficients, found.held, moving, of_level) if held and (moves or own)]
    # of a body that is carried the prior says what data do not, and no deviation knows of it
    stds = found.uncertainty.std[10 * structure.bodies :]
    names += [c.name for c, std in zip(structure.coefficients, stds) if c.of_body and not np.isfinite(std)]
    names += [v.name for v, std in zip(structure.shape_values, found.shape_std) if not (v.held or np.isfinite(std))]
    if names:
        warn(f"this log cannot tell {', '.join(names)} from the rest of the model: held at the prior")


# Of a joint that moves through its reversals, a few per cent of the rows are slow; more means that it was held.
_MUCH_STANDING = 0.1
_NO_TORQUE = 1e-12  # N m: no robot is moved by less


def refuse_no_torque(train: list[logs.Log]) -> None:
    """Raises LogError: the torque of every joint is nought in every row."""
    if not any(np.abs(segment.tau).max(initial=0.0) >= _NO_TORQUE for log in train for segment in log.segments):
        raise LogError("the torque of every joint is 0 in every row: none was logged", where=str(train[0].path), do="name the columns of torque in data.columns.torque, or what drives the joints in actuator")


def refuse_no_row(motion: Motion) -> None:
    """Raises LogError: no row of any joint counts."""
    counted = [joint for joint, out in zip(motion.joints, motion.left_out) if out < motion.samples and joint not in motion.unused]
    if not counted:
        why = events.told(motion.events, motion.disturbed, "training", len(motion.joints))
        raise LogError(f"no row of the training logs counts{''.join(f'; {one}' for one in why[:1])}", do="give logs in which the joints move and their torque is measured")


def tell_still(motion: Motion, spec) -> None:
    """Joints that stand still in much of what they are logged in, where that counts, or in all of it."""
    often = [f"{joint} {100 * share:.0f} %" for joint, share in zip(motion.joints, motion.standing) if share > _MUCH_STANDING and joint not in motion.still]
    if often and spec.standstill == "keep":
        warn(f"joints that stand still in much of their rows, where friction may have any value up to its greatest: {', '.join(often)}; preprocess.standstill: auto leaves them out")
    lacking = {joint for event in motion.events if event.kind == "missing" for joint in event.joints}
    silent = [joint for joint, out in zip(motion.joints, motion.left_out) if joint in lacking and out >= motion.samples]
    if silent:
        warn(f"the torque of {', '.join(silent)} never changes in the training logs, though the joint moves: none was logged; log it, or name the joint in data.unused; where nothing drives the joint, preprocess.events: keep takes its torque as it is")
    for joint in (one for one in motion.still if one not in silent):
        warn(f"joint {joint!r} never moves in the training logs, or never clear of a standstill; its friction is held at its prior, and its bodies are where the other joints' torque leaves them")


def tell_left_out(motion: Motion, spec) -> None:
    """How many rows of each joint's reversals and of jumps of acceleration are left out."""
    shares = [f"{joint} {100 * count / motion.samples:.0f} %" for joint, count in zip(motion.joints, motion.left_out) if count and joint not in (*motion.unused, *motion.still)]
    if spec.standstill == "auto" and shares:
        warn(f"rows around each joint's reversals and standstill and around jumps of acceleration, which the filter smears, are left out of its fit and its error: {', '.join(shares)}; preprocess.standstill: keep uses every row")


def tell_events(part: str, motion: Motion) -> list[dict]:
    """The events of a part as documents have them; the user is told."""
    for notice in events.told(motion.events, motion.disturbed, {"train": "training"}.get(part, part), len(motion.joints)):
        warn(notice)
    return [{"part": part, "kind": e.kind, "log": e.log, "start": e.start, "stop": e.stop, "joints": list(e.joints), "signal": e.signal} for e in motion.events]


def tell_overlap(experiment: Experiment, found: list[dict]) -> None:
    """Test logs that training has seen."""
    hashes = [set(log.get("files", {}).values()) or {log["sha256"]} for log in found]
    trained = list(zip(experiment.data.train, hashes))
    for test, own in zip(experiment.data.test, hashes[len(trained) :]):
        for train, other in trained:
            if not logs.overlapping(test, own, train, other):
                continue
            if own == other and test.name != train.name:
                warn(f"test log {test.name} is the training log {train.name} under another name; its error {NOT_HELD_OUT}")
            else:
                warn(f"test log {test.name} overlaps a training log; its error {NOT_HELD_OUT}")


def samples_of(part: str, read: list[logs.Log]) -> list[Sampled]:
    """What tells whether logs hold what others do; of long ones nothing."""
    return [sampled(log.name, part, log.segments) for log in read if not isinstance(log.segments, Spans)]


def tell_same(read: list[Sampled], experiment: Experiment, provenance: list[dict]) -> None:
    """Logs that hold samples of others; what `tell_overlap` says is not said again."""
    whole = [log["sha256"] for log in provenance]
    files = {log.name: sha for log, sha in zip((*experiment.data.train, *experiment.data.test), whole)}
    for found in same(read) if len(read) > 1 else ():
        others = tuple(one for one in found.others if files.get(one.name) != files.get(found.first.name))
        if others:
            warn(told(replace(found, others=others)))
