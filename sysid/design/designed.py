"""An experiment, its logs and its limits -> the next motion, with what it promises.

fit of the logs that exist (or, without any, the URDF) -> model, noise, information so far
limits and shapes of links -> what a motion must keep to
random motions within the limits -> starts, and the yardstick
linear programs -> the motion
fit + motion -> deviations now and after, and which suspects will be told apart
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..candidates import candidates
from ..errors import ConfigError
from ..estimate import Fit
from ..filters import settled
from ..log import Log
from ..lowpass import lowpassed, widest
from ..motion import Motion
from ..noise import of_angles
from ..prediction import predict
from ..preprocess import prepare
from ..segment import Segment
from ..specs import Experiment
from ..warned import noticed, warn
from . import promise
from .basis import Basis, basis
from .fourier import Fourier
from .limits import Limits, LimitsSpec, limits
from .links import geometry
from .noise import noise_of
from .problem import Problem, shares, torque
from .result import Design
from .search import searched
from .solve import Found

HARMONICS = 5


def design(
    experiment: Experiment, *, duration: float = 20.0,
    separate: Sequence[tuple[str, str]] | None = None,
    limits_spec: LimitsSpec | None = None, seed: int = 0, processes: int | None = None,
    levels: Mapping[str, str] | None = None, diagnosis: Mapping | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Design:  # fmt: skip
    """The next motion to log.

    Args:
        duration [s]. separate: suspects, (effect, joint) each, `*` for the robot; none of them for the
            motion that tells most; None: what the diagnosis could not tell apart.
        limits_spec: limits beside the URDF's. seed: of the starts.
        processes: that share the starts, as many as there are cores where it is None; the motion is
            the same whatever their number.
        levels: {group: level} of logs that the motion is for, where effects are per group; the
            first level by default, which is told.
        diagnosis: the document of one of the experiment, as `sysid diagnose --json` has it: how likely it
            found each suspect counts in what is promised. One of other logs is left aside.

    Raises:
        SysidError: bad input, or no motion keeps to the limits.
    """
    tell = progress or (lambda stage, share: None)
    if not 2.0 <= duration <= 600.0:
        raise ConfigError(f"--duration {duration:g}", allowed="2 to 600 s")
    with noticed() as notices:
        base = basis(experiment, separate, tell, levels or {}, diagnosis)
        problem, bounds = posed(base, duration, limits_spec)
        found, random_best = searched(
            problem, base.pose, base.fastest, seed, processes=processes, tell=tell
        )
        if found is None:
            raise ConfigError(
                f"no motion keeps to the limits: {_why(problem, base.pose)}", where="design",
                do="give wider limits, a smaller clearance, or logs about another pose",
            )  # fmt: skip
        for text in bounds.said:
            warn(text)
    return _told(base, problem.of(found.family), bounds, found, random_best, notices)


def posed(
    base: Basis, duration: float, limits_spec: LimitsSpec | None = None
) -> tuple[Problem, Limits]:
    """The problem of a design of a duration [s], within limits less their margin, and the limits.

    Raises:
        SysidError: see `limits`.
    """
    seen = None if base.fit is None else _greatest(base.fit)
    fastest = None if base.motion is None else _fastest(base.motion)
    bounds = limits(base.robot, limits_spec, seen, fastest)
    family = Fourier(duration, HARMONICS, 1, base.robot.dof)
    shapes = geometry(base.robot, bounds.floor).about(base.pose, bounds.clearance)
    return Problem(base.known, bounds.inner(), shapes, family, base.rate), bounds


def _fastest(motion) -> np.ndarray:
    """(dof,) greatest speed of a motion."""
    return np.max([np.abs(p.qd[p.core]).max(axis=0) for p in motion.pieces], axis=0)


def _greatest(fit: Fit) -> np.ndarray:
    parts = [p.measured for p in fit.predictions.values()]
    most = np.max([np.abs(m).max(axis=0) for m in parts], axis=0)
    return np.where(np.isfinite(noise_of(fit)), most, np.inf)  # of an unused joint no log says any


def _why(problem: Problem, pose) -> str:
    """Which limit the middle pose of all motions passes."""
    own = problem.limits
    outside = (pose < own.position[:, 0]) | (pose > own.position[:, 1])
    joints = problem.known.model.robot.joints
    if outside.any():
        j = int(np.argmax(outside))
        return f"{joints[j]} at {pose[j]:.3g} is outside {own.position[j, 0]:.3g} to {own.position[j, 1]:.3g}"
    held = np.abs(torque(problem, pose[None], 0.0 * pose[None], 0.0 * pose[None])[0])
    if (held > own.torque).any():
        j = int(np.argmax(held / own.torque))
        return f"holding {joints[j]} against gravity needs {held[j]:.3g} of {own.torque[j]:.3g}"
    near = float(problem.geometry.least(pose[None])[0])
    return (
        f"links come within {near:.3g} m of each other or the floor, allowed is {own.clearance:g}"
    )


def _told(
    base: Basis, problem: Problem, bounds: Limits, found: Found, random_best, notices
) -> Design:
    family = problem.family
    t = np.arange(int(round(family.duration * base.rate)) + 1) / base.rate
    q, qd, qdd, _ = family.motion(found.z, t)
    needed = torque(problem, q, qd, qdd)
    spread, pairs = {}, []
    if base.fit is not None:
        log = _log(base, t, q, needed)
        spread = promise.deviations(base.fit, base.motion, _fitted(base, log), _heard(base))
        if len(base.known.suspects) > 1:
            seen = _questioned(base, log)
            asked = len(candidates(base.fit.model, ()))
            who = base.known.suspects, seen, seen.samples, asked
            pairs = promise.pairs(base.fit, *who, base.chances)
    return Design(
        joints=base.robot.joints, family=family, coefficients=family.coefficients(found.z),
        amounts=found.z[:, family.waves :],
        t=t, q=q, qd=qd, qdd=qdd, torque=needed, log_det=found.log_det, random_best=random_best,
        deviations=spread, pairs=tuple(pairs), margins=_margins(problem, bounds, found),
        limits=bounds, said=tuple(notices),
    )  # fmt: skip


def _log(base: Basis, t, q, needed) -> Log:
    """The log of a motion (n, dof), its other signals as they usually are.

    Args:
        t (n,) [s]; needed (n, dof), the torque of the motion.
    """
    old = base.motion
    usual = {
        name: np.full(len(t), np.median(np.concatenate([p.signals[name] for p in old.pieces])))
        for name in old.pieces[0].signals
    }
    segment = Segment(t, float(t[1] - t[0]), q, needed, None, None, usual)
    return Log("designed", Path("designed"), "", (segment,), unused=old.unused, levels=base.levels)


def _fitted(base: Basis, log: Log) -> Motion:
    """A log as a fit sees it: filtered, rows around reversals left out."""
    spec = settled(base.fit.experiment.preprocess, base.fit.filters)
    with noticed():
        return prepare([log], spec, base.fit.joints)


def _questioned(base: Basis, log: Log) -> Motion:
    """A log as a diagnosis sees it: under its low-pass, standstill left out; as a fit does where it is
    too short for that."""
    found = lowpassed([log], base.fit.joints, widest([*base.logs, log]))
    return _fitted(base, log) if found is None else found


def _heard(base: Basis) -> promise.Heard:
    """Where the noise of the next log is heard: in what the fit leaves of all logs that there are."""
    fit = base.fit
    spec, of = settled(fit.experiment.preprocess, fit.filters), (fit.model, fit.x)
    logs, motions = [base.logs], [base.motion]
    if base.test:
        with noticed():
            motions.append(prepare(base.test, spec, fit.joints))
        logs.append(base.test)
    known = [predict(*of, motion) for motion in motions]
    made = [np.moveaxis(own, 0, -1) for own in of_angles(logs, motions, known, spec, of).torque]
    pieces = [piece for motion in motions for piece in motion.pieces]
    left = np.concatenate([one.residual for one in known])
    return promise.Heard(replace(base.motion, pieces=pieces), left, np.concatenate(made))


def _margins(problem: Problem, bounds: Limits, found: Found) -> dict[str, float]:
    """Shares of the allowed range that are left at the worst instant, and metres."""
    whole = replace(problem, limits=bounds)
    motion = whole.basis @ found.z.T
    most = shares(whole, motion, torque(whole, *motion[:3])).max(axis=(1, 2))
    names = ("position", "velocity", "acceleration", "jerk", "torque")
    out = {name: float(1.0 - share) for name, share in zip(names, most)}
    near = problem.geometry.nearest(motion[0])
    return out | ({"collision": near} if np.isfinite(near) else {})
