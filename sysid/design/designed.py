"""An experiment, its logs and its limits -> the next motion, with what it promises.

fit of the logs that exist (or, without any, the URDF) -> model, noise, information so far
limits and shapes of links -> what a motion must keep to
random motions within the limits -> starts, and the yardstick
linear programs -> the motion
fit + motion -> deviations now and after, and which suspects will be told apart
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from .. import pipeline
from ..errors import ConfigError, SysidWarning
from ..estimate import Fit
from ..specs import Experiment
from . import promise, solve
from .basis import Basis, basis
from .collision import geometry
from .columns import in_runs, of_the_instant
from .fourier import Fourier
from .information import noise_of
from .limits import Limits, LimitsSpec, limits
from .promise import played
from .result import Design
from .solve import Found, Problem

HARMONICS = 5
_ROUNDS = (1, 2, 4, 8)  # of the slowest harmonic
_FASTEST = 0.25  # of a period of the filter's window: what it still lets through of the fastest
_DRAWN = 4  # random motions for each number of rounds; the best is where the search begins
_IMPROVED = 2  # numbers of rounds from which it begins: those whose best random motion tells most


def design(
    experiment: Experiment, *, duration: float = 20.0, separate: Sequence[tuple[str, str]] = (),
    limits_spec: LimitsSpec | None = None, seed: int = 0,
    progress: Callable[[str, float], None] | None = None,
) -> Design:  # fmt: skip
    """The next motion to log.

    Args:
        duration [s]. separate: suspects, (effect, joint) each, `*` for the robot.
        limits_spec: limits beside the URDF's. seed: of the starts.

    Raises:
        SysidError: bad input, or no motion keeps to the limits.
    """
    tell = progress or (lambda stage, share: None)
    if not 2.0 <= duration <= 600.0:
        raise ConfigError(f"--duration {duration:g}", allowed="2 to 600 s")
    with pipeline.noticed() as notices:
        base = basis(experiment, separate, tell)
        seen = None if base.fit is None else _greatest(base.fit)
        fastest = None if base.motion is None else _fastest(base.motion)
        bounds = limits(base.robot, limits_spec, seen, fastest)
        family = Fourier(duration, HARMONICS, 1, base.robot.dof)
        shapes = geometry(base.robot, bounds.floor).about(base.pose, bounds.clearance)
        problem = Problem(base.known, bounds.inner(), shapes, family, base.rate)
        found, random_best = _searched(problem, base, seed, tell)
        for text in bounds.said:
            warnings.warn(SysidWarning(text), stacklevel=2)
    return _told(base, replace(problem, family=found.family), bounds, found, random_best, notices)


def _fastest(motion) -> np.ndarray:
    """(dof,) greatest speed of a motion."""
    return np.max([np.abs(p.qd[p.core]).max(axis=0) for p in motion.pieces], axis=0)


def _greatest(fit: Fit) -> np.ndarray:
    parts = [p.measured for p in fit.predictions.values()]
    most = np.max([np.abs(m).max(axis=0) for m in parts], axis=0)
    return np.where(np.isfinite(noise_of(fit)), most, np.inf)  # of an unused joint no log says any


def _searched(problem: Problem, base: Basis, seed: int, tell) -> tuple[Found, float]:
    """The best motion of all starts, and log det M of the best random one."""
    fastest = _FASTEST / base.window
    duration = problem.family.duration
    rounds = [r for r in _ROUNDS if r * HARMONICS / duration <= fastest] or [1]
    rng, best, starts = np.random.default_rng(seed), None, []
    for own in rounds:
        posed = replace(problem, family=replace(problem.family, rounds=own))
        drawn = [solve.shrunk(posed, solve.drawn(posed, base.pose, rng)) for _ in range(_DRAWN)]
        told = [(solve.value(posed, z), z) for z in drawn if z is not None]
        if told:
            starts.append((*max(told, key=lambda one: one[0]), posed))
    random_best = max((one[0] for one in starts), default=-np.inf)
    starts = sorted(starts, key=lambda one: -one[0])[:_IMPROVED]
    for number, (_, z, posed) in enumerate(starts):
        report = lambda share, number=number: tell("design", (number + share) / len(starts))  # noqa: E731
        try:
            found = solve.improved(posed, z, report)
        except KeyboardInterrupt:
            if best is None:
                raise
            break  # the best so far keeps to the limits
        if np.isfinite(found.value) and (best is None or found.value > best.value):
            best = found
    if best is None:
        raise ConfigError(
            f"no motion keeps to the limits: {_why(problem, base.pose)}", where="design",
            do="give wider limits, a smaller clearance, or logs about another pose",
        )  # fmt: skip
    return best, random_best


def _why(problem: Problem, pose) -> str:
    """Which limit the middle pose of all motions passes."""
    own = problem.limits
    outside = (pose < own.position[:, 0]) | (pose > own.position[:, 1])
    joints = problem.known.model.robot.joints
    if outside.any():
        j = int(np.argmax(outside))
        return f"{joints[j]} at {pose[j]:.3g} is outside {own.position[j, 0]:.3g} to {own.position[j, 1]:.3g}"
    held = np.abs(solve.torque(problem, pose[None], 0.0 * pose[None], 0.0 * pose[None])[0])
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
    family = found.family
    t = np.arange(int(round(family.duration * base.rate)) + 1) / base.rate
    q, qd, qdd, _ = family.motion(found.z, t)
    needed = solve.torque(problem, q, qd, qdd)
    spread, pairs = {}, []
    if base.fit is not None:
        spread = promise.deviations(base.fit, _more(base.fit, q, qd, qdd))
        if len(base.suspects) > 1:
            new = played(q, qd, qdd, 1.0 / base.rate, base.motion)
            pairs = promise.pairs(base.fit, base.suspects, base.motion, new, len(t))
    return Design(
        joints=base.robot.joints, family=family, coefficients=family.coefficients(found.z),
        t=t, q=q, qd=qd, qdd=qdd, torque=needed, log_det=found.value, random_best=random_best,
        deviations=spread, pairs=tuple(pairs), margins=_margins(problem, bounds, found),
        limits=bounds, said=tuple(notices),
    )  # fmt: skip


def _more(fit: Fit, q, qd, qdd) -> np.ndarray:
    """C'C (dof, size, size) of a motion's rows in the fit's parameters; zero for effects that look
    back in time."""
    instant = of_the_instant(fit.model)
    places = [fit.model.names.index(name) for name in instant.names]
    out = np.zeros((len(fit.joints), fit.model.size, fit.model.size))
    for _, found in in_runs(instant, q, qd, qdd):
        for j, own in enumerate(found):
            out[j][np.ix_(places, places)] += own @ own.T
    return out


def _margins(problem: Problem, bounds: Limits, found: Found) -> dict[str, float]:
    """Shares of the allowed range that are left at the worst instant, and metres."""
    whole = replace(problem, limits=bounds)
    motion = found.family.motion(found.z, solve.checked(whole))
    most = solve.shares(whole, motion, solve.torque(whole, *motion[:3])).max(axis=(1, 2))
    names = ("position", "velocity", "acceleration", "jerk", "torque")
    out = {name: float(1.0 - share) for name, share in zip(names, most)}
    near = float(problem.geometry.least(motion[0][::10]).min())
    return out | ({"collision": near} if np.isfinite(near) else {})
