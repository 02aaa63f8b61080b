"""What a designed motion must keep to, and how much of it is left."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from .. import bounded
from ..errors import ConfigError
from ..robot import Robot
from ..simulate.motion import room, top_speeds
from ..spec_values import Number, Positive
from ..yaml_text import parse_yaml, plain

_MARGIN = 0.05  # of a range is kept free: what a controller overshoots by
_CLEARANCE = (
    0.01  # m between links: a centimetre, about what hulls of meshes and a controller err by
)
_RISE = 0.2  # s from rest to top speed, where nothing limits the acceleration: a quick arm's
_FILE = 1_000_000  # bytes

Range = Annotated[list[Number], Field(min_length=2, max_length=2)]


class LimitsSpec(BaseModel):
    """A limits file. By joint: position ranges [rad or m], and the most of velocity, acceleration,
    jerk and torque. margin: share of each kept free; clearance [m] between links; floor: height [m]
    in the base's frame that no link may go below."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    position: dict[str, Range] = {}
    velocity: dict[str, Positive] = {}
    acceleration: dict[str, Positive] = {}
    jerk: dict[str, Positive] = {}
    torque: dict[str, Positive] = {}
    margin: Annotated[float, Field(ge=0, lt=0.9)] = _MARGIN
    clearance: Annotated[float, Field(ge=0)] = _CLEARANCE
    floor: Number | None = None


@dataclass(frozen=True)
class Limits:
    """position (dof, 2), and velocity, acceleration, jerk, torque (dof,), the most of each, infinite
    where nothing limits it; `margin`: share kept free; clearance [m]; floor [m] or None. said: which
    of them nobody stated, in words."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    jerk: np.ndarray
    torque: np.ndarray
    margin: float = _MARGIN
    clearance: float = _CLEARANCE
    floor: float | None = None
    said: tuple[str, ...] = field(default=())

    @property
    def middle(self) -> np.ndarray:
        """(dof,) middle of the position ranges."""
        return self.position.mean(axis=1)

    @property
    def half(self) -> np.ndarray:
        """(dof,) half of the position ranges."""
        return 0.5 * np.ptp(self.position, axis=1)

    def inner(self) -> Limits:
        """These limits with the margin taken off."""
        kept = 1.0 - self.margin
        spread = kept * self.half[:, None] * np.array([-1.0, 1.0])
        return replace(
            self, position=self.middle[:, None] + spread, velocity=kept * self.velocity,
            acceleration=kept * self.acceleration, jerk=kept * self.jerk, torque=kept * self.torque,
            margin=0.0,
        )  # fmt: skip


def read(path: Path) -> LimitsSpec:
    """A limits file (YAML). Raises ConfigError."""
    try:
        data = bounded.read_bytes(path)
    except OSError as error:
        raise ConfigError(
            f"the limits cannot be read ({error.strerror})", where=str(path), do="check --limits"
        ) from None
    if len(data) > _FILE:
        raise ConfigError(f"limits of {len(data)} bytes", where=str(path), allowed=f"{_FILE}")
    tree = plain(parse_yaml(data.decode("utf-8-sig", errors="replace"), where=str(path))) or {}
    try:
        return LimitsSpec.model_validate(tree)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise ConfigError(
            f"{key}: {first['msg'].removeprefix('Value error, ')}", where=str(path),
            allowed=", ".join(LimitsSpec.model_fields), do="correct the key or its value",
        ) from None  # fmt: skip


def limits(
    robot: Robot,
    spec: LimitsSpec | None,
    seen: np.ndarray | None,
    fastest: np.ndarray | None = None,
) -> Limits:
    """The limits of a robot: the URDF's, those of a file within them, and what takes the place of
    those that nobody states.

    Args:
        seen: (dof,) the greatest torque that the robot's logs hold, None without a log; fastest:
            (dof,) the greatest speed. Speeds stay within that, or within what a robot of this size
            usually moves at, unless the file says more: beyond, filters, clocks and controllers
            err by more than what is asked.

    Raises:
        ConfigError: a joint that is not there, a range that holds nothing.
    """
    spec = spec or LimitsSpec()
    for key in ("position", "velocity", "acceleration", "jerk", "torque"):
        for joint in getattr(spec, key):
            if joint not in robot.joints:
                raise ConfigError(
                    f"{key} limits the joint {joint!r}", where="--limits",
                    allowed=", ".join(robot.joints), do="correct the joint",
                )  # fmt: skip
    own = [robot.source.joints[joint] for joint in robot.joints]
    said: list[str] = []
    position = _positions(robot, spec, said)
    stated = np.array([joint.velocity for joint in own])
    usual = top_speeds(robot) if fastest is None else np.maximum(top_speeds(robot), fastest)
    asked = np.array([joint in spec.velocity for joint in robot.joints])
    stated = np.where(asked | (stated <= 0.0), stated, np.minimum(stated, usual))
    velocity = _most(robot, "velocity", stated, spec.velocity, usual, said)
    ramp = velocity / _RISE
    acceleration = _most(
        robot, "acceleration", np.full(robot.dof, np.inf), spec.acceleration, ramp, None
    )
    jerk = _most(robot, "jerk", np.full(robot.dof, np.inf), spec.jerk, ramp / _RISE, None)
    stated = np.array([joint.effort if joint.effort > 0.0 else np.inf for joint in own])
    free = np.full(robot.dof, np.inf) if seen is None else seen
    torque = _most(robot, "torque", stated, spec.torque, free, said)
    return Limits(
        position, velocity, acceleration, jerk, torque, spec.margin, spec.clearance, spec.floor,
        tuple(said),
    )  # fmt: skip


def _positions(robot: Robot, spec: LimitsSpec, said: list[str]) -> np.ndarray:
    middle, half = room(robot)
    out = np.array(robot.limits)
    for j, joint in enumerate(robot.joints):
        if not np.isfinite(out[j]).all():
            out[j] = middle[j] - half[j], middle[j] + half[j]
            if joint not in spec.position:
                said.append(f"{joint} has no position limits: {out[j, 0]:.3g} to {out[j, 1]:.3g}")
        if joint in spec.position:
            low, high = spec.position[joint]
            out[j] = (
                max(out[j, 0], low) if np.isfinite(robot.limits[j, 0]) else low,
                (min(out[j, 1], high) if np.isfinite(robot.limits[j, 1]) else high),
            )
        if not out[j, 0] < out[j, 1]:
            raise ConfigError(
                f"position of {joint!r} from {out[j, 0]:g} to {out[j, 1]:g} holds nothing",
                where="--limits", allowed="a range within the URDF's", do="widen it",
            )  # fmt: skip
    return out


def _most(robot: Robot, name: str, stated, given: dict, instead, said: list | None) -> np.ndarray:
    out = np.array(stated, dtype=float)
    for j, joint in enumerate(robot.joints):
        if joint in given:
            out[j] = min(out[j], given[joint])
        elif not np.isfinite(out[j]) or out[j] <= 0.0:
            out[j] = instead[j]
            if said is not None:
                value = f"{out[j]:.3g}" if np.isfinite(out[j]) else "none"
                said.append(f"{joint} has no {name} limit in the URDF: {value} is taken")
    return out
