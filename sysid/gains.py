"""Where a drive's free values start: the factor of its torque, and how late its command acts.

Both are told by a joint's own equation in the low-passed training logs. Of the columns of its bodies, motor and friction,
without any sign or prior, a command that acts d late leaves

    || (1 - P) (command(t - d) - q) || / || command(t - d) - q ||,

and the delay is where that is least, over all joints together (see `delays`): P is the same for all d. The factor starts where the URDF's bodies need the torque that
it makes; the fit goes on from there, with all bodies free.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from . import listed_effects, motor_side, rows
from . import log as logs
from .drive_spec import ActuatorSpec, FreeFactor
from .lowpass import band, lowpassed, stride_of, widest
from .motion import Motion
from .robot import Robot
from .segment import Segment
from .specs import EffectSpec, Experiment

_HAS = ("armature", "viscous", "coulomb", "torque_bias")  # what any joint has
_LATEST = 0.1  # s: a command that acts later is no servo's
_TRIED = 41  # delays before the least is refined
_FEWEST = 100  # rows
_CLEARLY = 0.5  # of what is left with the delay that all share: noise of a coarse encoder shifts one joint's own by tens of ms
_SINGULAR = 1e-9  # of the largest singular value of columns of one size


def started(experiment: Experiment, machine: Robot) -> Experiment:
    """An experiment whose drives' free values have a start, and free delays their value.

    Raises:
        SysidError: its logs cannot be read.
    """
    actuators, torques = dict(experiment.actuator), {j: dict(entry) for j, entry in experiment.data.torque.items()}
    late = [j for j, spec in actuators.items() if _waits(spec.delay)]
    open_ = [j for j, spec in actuators.items() if _waits(_factor(spec))]
    sums = [j for j, entry in torques.items() if _waits(entry[motor_side.leading(entry)])]
    if not (late or open_ or sums):
        return experiment
    plain = {j: spec.model_copy(update={"delay": 0.0}) for j, spec in actuators.items()}
    read = [logs.read(spec, experiment.data, machine.joints, machine.prismatic, experiment.folder, plain) for spec in experiment.data.train]
    motion_of = lambda drives: _seen(machine, read, drives)  # noqa: E731
    motion = motion_of(plain)
    if motion is None:
        return experiment
    found = _rows(machine, motion)
    if late:
        # the command alone, as a voltage would be read: what is left of servo - command is the angle under one low-pass
        alone = {j: _command(spec) for j, spec in plain.items()}
        commands = motion_of(alone)
        left = [_left(found, motion, commands, machine.joints.index(j), motor_side.drive(plain[j])) for j in late]
        for joint, delay in zip(late, delays(left)):
            own = FreeFactor(start=delay) if delay > 0.0 else 0.0
            actuators[joint] = actuators[joint].model_copy(update={"delay": own})
        motion = motion_of({j: replace_delay(spec, actuators[j]) for j, spec in plain.items()})
        found = _rows(machine, motion)
    for joint in open_:
        spec, start = actuators[joint], _start(found, machine, joint)
        key = {"kp": _begun(spec.kp, start)} if spec.command is not None else {"k": _begun(spec.k, start), "R": _begun(spec.R, 1.0)}
        actuators[joint] = spec.model_copy(update=key)
    for joint in sums:
        lead = motor_side.leading(torques[joint])
        torques[joint][lead] = _begun(torques[joint][lead], _start(found, machine, joint))
    data = experiment.data.model_copy(update={"torque": torques})
    return experiment.model_copy(update={"actuator": actuators, "data": data})


def _factor(spec: ActuatorSpec):
    return motor_side.drive(spec).factor


def _waits(value) -> bool:
    return isinstance(value, FreeFactor) and value.start is None


def _begun(factor: FreeFactor, start: float) -> FreeFactor:
    """A free factor with a start: within its bounds, where it has any."""
    if factor.within is not None:
        start = float(np.clip(start, *factor.within))
    return factor.model_copy(update={"start": start})


def replace_delay(spec: ActuatorSpec, other: ActuatorSpec) -> ActuatorSpec:
    """An actuator as late as another."""
    return spec.model_copy(update={"delay": other.delay})


def _command(spec: ActuatorSpec) -> ActuatorSpec:
    """A drive that is told by its command alone, times one."""
    column = spec.command if spec.command is not None else spec.voltage
    return ActuatorSpec(voltage=column)


def _seen(machine: Robot, read: list[logs.Log], drives: dict[str, ActuatorSpec]) -> Motion | None:
    """The training motion under one low-pass, each drive's torque per unit of its factor."""
    read = [replace(log, segments=tuple(_driven(machine, segment, drives) for segment in log.segments)) for log in read]
    cutoff = widest(read, known=(own_band := band(read)))
    return lowpassed(read, machine.joints, cutoff, known=own_band)


def _driven(machine: Robot, segment: Segment, drives: dict[str, ActuatorSpec]) -> Segment:
    tau = segment.tau.copy()
    for joint, spec in drives.items():
        j, command = machine.joints.index(joint), segment.signals[motor_side.command_name(joint)]
        tau[:, j], _ = motor_side.driven(motor_side.drive(spec), segment.t, command, segment.q[:, j])
    return replace(segment, tau=tau)


def _rows(machine: Robot, motion: Motion) -> rows.Rows:
    structure = listed_effects.build(machine, [EffectSpec(name=name) for name in _HAS])
    return rows.stack(structure, motion, stride_of(motion, motion.pieces[0].smoother.cutoff))


def _start(found: rows.Rows, machine: Robot, joint: str) -> float:
    """The factor at which a joint's signal is what the URDF's bodies need beside friction and a motor's inertia."""
    j, count = machine.joints.index(joint), 10 * len(machine.bodies)
    use = found.use[:, j]
    if use.sum() < _FEWEST:
        return 1.0
    needed = found.columns[j][use][:, :count] @ machine.prior.ravel()
    rest = [k for k in range(count, found.columns.shape[2]) if found.columns[j][use][:, k].any()]
    columns = np.column_stack([needed, found.columns[j][use][:, rest]])
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    share = np.linalg.lstsq(columns / size, found.tau[use, j], rcond=1e-6)[0][0] / size[0]
    if share > 0.0:
        return float(1.0 / share)
    return float(size[0] / max(np.linalg.norm(found.tau[use, j]), 1e-300))


def delays(left: list) -> list[float]:
    """Where each joint's delay [s] starts: where all leave least of their torques, as one controller commands them; where its own is
    least, if that is less than half of it. What is left to find is near.

    Args:
        left: of each joint, what its columns leave at a delay; None where there is too little to tell.
    """
    from scipy.optimize import minimize_scalar  # its import takes as long as a small fit

    left = [one if one is None else cache(one) for one in left]
    told = [one for one in left if one is not None]
    if not told:
        return [0.0] * len(left)

    def least(ones) -> float:
        total = lambda delay: float(sum(np.log(max(one(delay), 1e-300)) for one in ones))  # noqa: E731
        tried = np.linspace(0.0, _LATEST, _TRIED)
        best = int(np.argmin([total(delay) for delay in tried]))
        low, high = tried[max(best - 1, 0)], tried[min(best + 1, _TRIED - 1)]
        refined = minimize_scalar(total, bounds=(low, high), method="bounded", options={"xatol": 1e-6})
        return float(refined.x) if refined.fun < total(0.0) else 0.0

    together, out = least(told), []
    for one in left:
        alone = together if one is None or len(told) == 1 else least([one])
        out.append(alone if one is not None and one(alone) < _CLEARLY * one(together) else together)
    return out


def _left(found: rows.Rows, motion: Motion, commands: Motion, j: int, own: motor_side.Drive):
    """The share of its torque that a joint's own columns leave where its command acts a delay [s] late; None where rows are too few."""
    from scipy.interpolate import make_interp_spline

    use = found.use[:, j]
    columns = found.columns[j]
    columns = columns[:, columns.any(axis=0)]
    splines = [make_interp_spline(p.t, p.tau[:, j], k=3) for p in commands.pieces]
    angles = np.zeros(len(use))
    parts = [np.flatnonzero(found.piece == k) for k in range(len(motion.pieces))]
    for piece, command, part in zip(motion.pieces, commands.pieces, parts):
        if own.servo:
            angles[part] = (command.tau[:, j] - piece.tau[:, j] / own.start)[found.index[part]]
        use = use & ~((found.piece == found.piece[part[0]]) & (found.t < piece.t[0] + _LATEST)) if len(part) else use
    if use.sum() < _FEWEST:
        return None
    scaled = columns[use] / np.maximum(np.linalg.norm(columns[use], axis=0), 1e-300)
    basis, values, _ = np.linalg.svd(scaled, full_matrices=False)
    basis = basis[:, values > _SINGULAR * values[0]]

    def left(delay: float) -> float:
        acts = np.zeros(len(use))
        for spline, part in zip(splines, parts):
            acts[part] = spline(found.t[part] - delay)
        torque = (acts - angles)[use]
        # as a share: a servo that lags has little torque left where its command is as late as its joint is
        return float(np.linalg.norm(torque - basis @ (basis.T @ torque)) / max(np.linalg.norm(torque), 1e-300))

    return left
