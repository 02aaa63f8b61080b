"""What an experiment says of its robot: URDF, joints, rotors, gravity."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import AfterValidator, Field, model_validator

from .spec_values import (
    NonZero,
    Number,
    Positive,
    Spec,
    Text,
    Vector,
    _finite,
)


class CylinderSpec(Spec):
    """A cylinder along its frame's z axis [m]."""

    radius: Positive
    length: Positive


class InertiaSpec(Spec):
    """A body: a uniform box or cylinder of a mass [kg] and centre of mass [m], or its ten parameters."""

    mass: Positive | None = None
    com: Vector = [0.0, 0.0, 0.0]
    box: Annotated[list[Positive], Field(min_length=3, max_length=3)] | None = None
    cylinder: CylinderSpec | None = None
    parameters: Annotated[list[Number], Field(min_length=10, max_length=10)] | None = None

    def model_post_init(self, _context: Any) -> None:
        shapes = [key for key in ("box", "cylinder", "parameters") if getattr(self, key) is not None]
        if len(shapes) != 1:
            raise ValueError("give exactly one of box, cylinder, parameters")
        if (self.mass is None) != (self.parameters is not None):
            raise ValueError("mass goes with box or cylinder; parameters holds its own")


def _ratio(value: float) -> float:
    if value == 0:
        raise ValueError("a gear ratio of 0 drives nothing; give motor turns per joint turn")
    return value


Ratio = Annotated[float, AfterValidator(_finite), AfterValidator(_ratio)]


def _direction(value: list[float]) -> list[float]:
    if math.hypot(*value) < 1e-6:
        raise ValueError("must be a direction, not 0 0 0")
    return value


class RotorSpec(Spec):
    """A motor's rotor: a rigid body on a link, spinning `ratio` times as fast as its joint."""

    joint: str
    ratio: Ratio
    on: str
    xyz: Vector = [0.0, 0.0, 0.0]
    rpy: Vector = [0.0, 0.0, 0.0]
    axis: Annotated[Vector, AfterValidator(_direction)] = [0.0, 0.0, 1.0]
    inertia: InertiaSpec

    @model_validator(mode="before")
    @classmethod
    def _carrier(cls, value: Any) -> Any:
        """`link` is `on` in other words; tools of YAML 1.1 make a boolean of `on`."""
        given = [key for key in ("on", "link", True) if key in value] if isinstance(value, dict) else []
        if len(given) > 1:
            raise ValueError("on and link say the same: give one of them")
        return {"on" if key in given else key: entry for key, entry in value.items()} if given else value


class RobotSpec(Spec):
    """The URDF, the joints that move, and the rotors that they drive."""

    urdf: Text = "robot.urdf"
    joints: list[str] | None = None
    lock: dict[str, Number] = {}
    gravity: Vector = [0.0, 0.0, -9.81]
    rotors: list[RotorSpec] = []
    transmission: dict[str, Annotated[dict[str, NonZero], Field(min_length=1)]] = {}
