"""What a design starts from: the fit of the logs that exist, or the URDF where there are none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from .. import experiment_logs, pipeline
from ..candidates import Candidate, candidates, own_effects
from ..end_stops import LAWS, with_stops
from ..errors import ConfigError, LogError
from ..estimate import Fit
from ..filters import settled
from ..log import Log
from ..model import Model
from ..model_parameters import ROBOT
from ..motion import Motion
from ..posed_problem import known_bodies
from ..preprocess import prepare
from ..projection import inverted
from ..robot import Robot
from ..simulate.motion import draw, top_speeds
from ..smoother import Smoother
from ..specs import Experiment, PreprocessSpec
from ..warned import warn
from .columns import instant_of
from .information import Known, own_size
from .left_open import LeftOpen
from .left_open import read as logs_of
from .noise import noise_of, size_of
from .suspects import Seen, along, played, suspected, unseen

_WINDOW = 0.1  # s, where none is known
_FASTEST = 0.25  # of a period of the filter's window: what it still lets through of the fastest
_GUESSED = 0.02  # of a joint's torque: its noise, where no log says
_RATE = 500.0  # Hz, where no log says
# rad/s or m/s, and of the top speed: slower is standing (`preprocess`)
_STILL, _STILL_SHARE = 0.03, 0.03
_USUAL = 10.0  # s of a motion that says how a robot usually moves, where no log does


@dataclass(frozen=True)
class Basis:
    """What a design starts from. logs: those of the fit; motion: these, filtered; test: logs that it
    was tested on; chances: how likely a diagnosis of these found each suspect."""

    robot: Robot
    fit: Fit | None
    motion: Motion | None
    known: Known
    pose: np.ndarray
    rate: float
    window: float
    levels: Mapping[str, str]
    logs: tuple[Log, ...] = ()
    test: tuple[Log, ...] = ()
    chances: Mapping[str, float] = field(default_factory=dict)

    @property
    def fastest(self) -> float:
        """Harmonics [Hz] that the logs' filter still lets through."""
        return _FASTEST / self.window


def basis(
    experiment: Experiment,
    separate,
    tell,
    levels: Mapping[str, str] = MappingProxyType({}),
    diagnosis: Mapping | None = None,
) -> Basis:
    """What an experiment knows of its robot at {group: level}. Raises SysidError."""
    left = LeftOpen.of(diagnosis, separate)
    machine, structure, prior = pipeline.build(experiment)
    levels = _levels(structure, levels)
    _suspects(experiment, structure, left.suspects)  # one that is not there is told before any work
    fit, motion, logs, test = None, None, (), ()
    if _has_logs(experiment):
        read = experiment_logs.read_all(experiment)
        fit = pipeline.fit(experiment, progress=tell, measured=read)
        spec = settled(fit.experiment.preprocess, fit.filters)
        motion = prepare(read.train, spec, machine.joints)
        structure, x = fit.model, fit.x
        if diagnosis is not None and left.logs != logs_of(fit.logs):
            left = LeftOpen.of(None, separate)  # of other logs
        logs, test = tuple(read.train), tuple(read.test)
        noise = noise_of(fit)
        pose = np.concatenate([p.q for p in motion.pieces]).mean(axis=0)
        rate = 1.0 / motion.pieces[0].step
        window = float(fit.filters.get("window", _WINDOW))
    else:
        warn(
            "there is no log yet: the design rests on the URDF, with noise of "
            f"{100 * _GUESSED:g} % of each joint's torque limit"
        )
        x = np.concatenate([prior.ravel(), np.zeros(len(structure.coefficients))])
        effort = np.array([machine.source.joints[j].effort for j in machine.joints])
        noise = _GUESSED * np.where(np.isfinite(effort) & (effort > 0.0), effort, 10.0)
        low, high = np.where(np.isfinite(machine.limits.T), machine.limits.T, [[-1.0], [1.0]])
        pose = np.clip(np.zeros(machine.dof), 0.9 * low + 0.1 * high, 0.1 * low + 0.9 * high)
        rate, window = experiment.data.rate or _RATE, _WINDOW
    if separate is None and left.suspects:
        words = " and ".join(f"{effect}:{joint}" for effect, joint in left.suspects)
        said = f"the motion is to tell {words} apart, which the last diagnosis could not"
        warn(f"{said}; --separate none designs the one that tells most")
    asked = _suspects(experiment, structure, left.suspects)
    known = _known(experiment, structure, levels, fit, x, noise, prior, asked, motion)
    known = replace(known, **_left_out(machine, experiment, fit, rate, window))
    return Basis(machine, fit, motion, known, pose, rate, window, levels, logs, test, left.chances)


def _left_out(machine: Robot, experiment: Experiment, fit, rate: float, window: float) -> dict:
    """Which rows of a joint a fit leaves out: `reach` [s] of a reversal within which, and the speed
    (dof,) below which."""
    spec = experiment.preprocess if fit is None else settled(fit.experiment.preprocess, fit.filters)
    if spec.standstill == "keep":
        return {}
    if fit is None:
        spec = PreprocessSpec(window=window, standstill=spec.standstill)
    rows, _ = Smoother(spec, 1.0 / rate).smear(spec.torque == "same" and spec.filter != "none")
    if spec.standstill not in ("auto", "mask"):
        return {"slowest": np.full(machine.dof, float(spec.standstill))}
    slowest = np.minimum(_STILL, _STILL_SHARE * top_speeds(machine))
    return {"reach": rows / rate if spec.standstill == "auto" else 0.0, "slowest": slowest}


def _levels(model: Model, levels: Mapping[str, str]) -> dict[str, str]:
    """The level of each group that a motion is designed for: as given, else the first, which is
    told."""
    first = {group: own[0] for group, own in model.groups.items() if group not in levels}
    for group, level in first.items():
        others = ", ".join(model.groups[group][1:])
        said = f"the motion is designed for {group} {level}; --level {group}=LEVEL ({others})"
        warn(f"{said} designs for another")
    chosen = {**levels, **first}
    model.at(chosen, np.zeros(model.size))  # a level that is not there is told before any work
    return chosen


def _has_logs(experiment: Experiment) -> bool:
    """Whether the training logs are there: all of them, or none."""
    named = [name for log in experiment.data.train for name in log.names]
    there = [(experiment.folder / name).exists() or ":" in name for name in named]
    if any(there) and not all(there):
        missing = named[there.index(False)]
        raise LogError("there is no such file", where=missing, do="check data.train")
    return all(there)


def _suspects(experiment: Experiment, model: Model, separate) -> list[Candidate]:
    joints = model.robot.joints
    of_stops = {n: [joints.index(j) for e, j in separate if e == n and j in joints] for n in LAWS}
    every = candidates(model, with_stops(own_effects(experiment), model, of_stops))
    out = []
    for effect, joint in separate:
        if joint != "*" and joint not in joints:
            raise ConfigError(
                f"--separate names the joint {joint!r}", allowed=", ".join((*joints, "*")),
                do="correct the joint",
            )  # fmt: skip
        number = ROBOT if joint == "*" else joints.index(joint)
        own = [c for c in every if c.key == (effect, number)]
        if not own:
            there = sorted({c.name for c in every if c.joint == number})
            raise ConfigError(
                f"--separate names {effect}:{joint}, which is no effect that the model lacks there",
                allowed=", ".join(there), do="correct the effect",
            )  # fmt: skip
        out.append(own[0])
    return out


def _known(
    experiment: Experiment, model: Model, levels, fit: Fit | None, x, noise, prior, asked, motion
) -> Known:
    """What a design asks of: the model's instant, and the suspects."""
    instant, places = instant_of(model, levels)
    own = np.asarray(x)[places]
    typical = np.maximum(20.0 * noise, 1e-6) if fit is None else size_of(fit)
    sure = known_bodies(experiment, model)
    before = alone = own_size(instant, prior, own, typical, sure)
    if not asked:
        if fit is not None:
            before = before + _told(fit, levels, places, noise)
        return Known(instant, own, noise, before, alone=alone)
    if instant.reference is None:
        instant = instant.referring_to(own)
    if fit is None:
        q, qd, qdd = usual = _usual(model.robot)
        instant = instant.scaled_by(played(q, qd, qdd, 1.0 / _RATE, model.robot.joints))
        suspects = tuple(unseen(instant, own, *usual, one, typical) for one in asked)
        columns = along(suspects, instant, own, *usual)
        each, more = np.sqrt(np.mean(columns**2, axis=(0, 2))), None
    else:
        instant = instant.scaled_by(motion)
        seen = Seen.of(fit, motion, motion.samples)
        wide = own_size(fit.model, fit.prior, fit.x, typical, sure)
        suspects = tuple(suspected(seen, fit, wide, one) for one in asked)
        columns = np.concatenate([seen.columns(one) for one in suspects], axis=2)
        each, more = np.sqrt(np.mean(columns**2, axis=(0, 1))), seen
    size = np.zeros(instant.size + len(each))
    whole = np.diag(size)
    whole[: instant.size, : instant.size] = before
    # a suspect is about as large as would make a joint's torque
    large = (each / np.max(typical)) ** 2
    k = np.arange(instant.size, len(size))
    whole[k, k] = np.where(large > 0.0, large, 1.0)
    alone = whole.copy()
    if more is not None:
        both = np.concatenate([more.rows.columns[:, :, places], columns], axis=2)
        flat = (both * more.weights[:, None, None]).reshape(-1, len(size))
        whole += flat.T @ flat
    return Known(instant, own, noise, whole, suspects, alone)


def _told(fit: Fit, levels: Mapping[str, str], places, noise) -> np.ndarray:
    """What the logs tell of parameters, whatever those of other levels are; those of effects that
    look back in time taken as known."""
    whole = np.zeros((fit.model.size, fit.model.size))
    for factor in fit.compressed.by_joint:
        rows = factor.triangle[:, :-1] / noise[factor.joint]
        whole[np.ix_(factor.columns, factor.columns)] += rows.T @ rows
    _, here = fit.model.at(levels, np.arange(fit.model.size))
    others = np.setdiff1d(np.arange(fit.model.size), here)
    told, cross = whole[np.ix_(places, places)], whole[np.ix_(places, others)]
    if not others.size:
        return told
    return told - cross @ inverted(whole[np.ix_(others, others)]) @ cross.T


def _usual(robot: Robot) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, speeds and accelerations (n, dof) that a robot of this size usually moves with."""
    t = np.arange(0.0, _USUAL, 1.0 / _RATE)
    found = draw(robot, t, np.random.default_rng(0))
    return found.q, found.qd, found.qdd
