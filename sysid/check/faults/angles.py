"""What the angles show by themselves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...log import DEGREES
from ...lowpass.angles import grains
from ..fault import ERROR, WARNING, Fault
from ..look import Logged, Look

AFTER, SENSELESS = 1, ("wrong_unit",)
_TURN = 2.0 * np.pi
_NEAR = 0.1  # of a turn: so near to a whole one is a jump of the count, and no motion
_BEYOND = 0.02  # rad or m beyond a limit, and share of the range
_FASTER = 1.5  # times a limit of speed, as many a URDF states the rated one
_COARSE = _TURN / 2**12  # rad: a velocity by differences then is mostly steps
_STILL, _MOSTLY = 0.01, 0.6  # of a joint's top speed; of the samples
_TRAVELS, _MOVES = (0.1, 0.02), 0.05  # rad, m; rad/s: less tells nothing of a body
_SPAN = 0.05  # s over which a speed is taken
_SHOWN = 8


def find(look: Look) -> Iterator[Fault]:
    """angle_wrap, wrong_unit, limit_exceeded, coarse_values, standstill, not_excited."""
    for j, joint in enumerate(look.robot.joints):
        slides = bool(look.robot.prismatic[j])
        wrong = False
        for log in look.logs:
            for fault in _of_log(look, log, j, joint, slides):
                wrong |= fault.severity == ERROR
                yield fault
        if not wrong:
            yield from _of_training(look, j, joint, slides)


def _of_log(look: Look, log: Logged, j: int, joint: str, slides: bool) -> Iterator[Fault]:
    q, name = log.q[:, j], log.log.name
    steps = np.diff(q)
    wraps = np.flatnonzero(np.abs(np.abs(steps) - _TURN) < _NEAR * _TURN) if not slides else []
    if len(wraps) and np.median(np.abs(steps)) < 0.1 * _TURN:
        times = tuple(float(log.t[k + 1]) for k in wraps[:_SHOWN])
        yield Fault(
            "angle_wrap",
            ERROR,
            (
                f"the angle of {joint} jumps by a turn {len(wraps)} times in {name}, "
                f"first at {times[0]:.4g} s"
            ),
            "unwrap it (numpy.unwrap) before it is logged",
            joint,
            name,
            times,
            len(wraps),
        )
        return
    largest = float(np.abs(q).max())
    if not slides and largest > DEGREES and look.experiment.data.units.position == "rad":
        yield Fault(
            "wrong_unit",
            ERROR,
            (f"{joint} reaches {largest:.4g} rad in {name}, {largest / _TURN:.2g} turns"),
            "if that is degrees set data.units.position: deg",
            joint,
            name,
            (float(log.t[int(np.argmax(np.abs(q)))]),),
            int(np.sum(np.abs(q) > DEGREES)),
        )
        return
    low, high = look.robot.limits[j]
    room = _BEYOND * max(1.0, high - low) if np.isfinite(high - low) else np.inf
    beyond = np.flatnonzero((q < low - room) | (q > high + room)) if high > low else []
    if len(beyond):
        at = beyond[int(np.argmax(np.maximum(low - q[beyond], q[beyond] - high)))]
        yield Fault(
            "limit_exceeded",
            WARNING,
            (f"{joint} is at {q[at]:.4g} in {name}, beyond its limits of {low:.4g} to {high:.4g}"),
            "is this the joint's column, its unit, its zero, this robot's URDF?",
            joint,
            name,
            (float(log.t[at]),),
            len(beyond),
        )
    top, allowed = _speed(log, j), look.robot.source.joints[joint].velocity
    if np.isfinite(allowed) and np.quantile(top, 0.999) > _FASTER * allowed:
        at = int(np.argmax(top))
        yield Fault(
            "limit_exceeded",
            WARNING,
            f"{joint} moves at {top.max():.3g} in {name}, its limit is {allowed:.3g}",
            "is this the joint's column, its unit, this robot's URDF?",
            joint,
            name,
            (float(log.t[min(at, len(log.t) - 1)]),),
            int(np.sum(top > _FASTER * allowed)),
        )
    grain = float(grains(q[:, None])[0])
    if not slides and grain > _COARSE:
        yield Fault(
            "coarse_values",
            WARNING,
            (
                f"the angle of {joint} comes in steps of {grain:.2g} rad in {name}, "
                f"{_TURN / grain:.0f} a turn"
            ),
            "log it with more digits, or on the motor's side of the gear",
            joint,
            name,
            rows=len(q),
        )


def _speed(log: Logged, j: int) -> np.ndarray:
    """Size of a joint's speed over short spans."""
    span = max(1, round(_SPAN / log.step))
    return np.abs(log.q[span:, j] - log.q[:-span, j]) / np.maximum(
        log.t[span:] - log.t[:-span], 1e-9
    )


def _of_training(look: Look, j: int, joint: str, slides: bool) -> Iterator[Fault]:
    own = look.part("train")
    travel = max(float(np.ptp(log.q[:, j])) for log in own)
    speeds = [_speed(log, j) for log in own if len(log.t) > 2.0 * _SPAN / log.step]
    speed = np.concatenate(speeds) if speeds else np.zeros(1)
    top = float(np.quantile(speed, 0.99))
    if travel < _TRAVELS[slides] or top < _MOVES * (1.0 if not slides else 0.2):
        yield Fault(
            "not_excited",
            WARNING,
            (
                f"{joint} travels {travel:.2g} at up to {top:.2g} a second in the "
                "training logs: what it carries and its friction stay as the prior says"
            ),
            "log it moving, or leave it out with robot.lock",
            joint,
            rows=sum(len(log.t) for log in own),
        )
        return
    still = speed < _STILL * top
    if np.mean(still) > _MOSTLY:
        yield Fault(
            "standstill",
            WARNING,
            (
                f"{joint} stands in {100 * np.mean(still):.0f} % of the training "
                "samples, where its friction may have any value up to its greatest"
            ),
            "log more motion; preprocess.standstill: auto leaves these rows out",
            joint,
            rows=int(np.sum(still)),
        )
