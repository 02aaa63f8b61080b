"""Units of a log, converted once, where it is read; and the names of units for prismatic joints."""

import math

TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
POSITION = {"rad": 1.0, "m": 1.0, "deg": math.pi / 180.0, "mm": 1e-3}
TORQUE = {"N m": 1.0, "N": 1.0, "A": 1.0}  # A is multiplied by the joint's torque constant


def of_joint(unit: str, *, prismatic: bool) -> str:
    """A unit written for a revolute joint, as it reads on a prismatic one: N m -> N, rad -> m, kg m^2 -> kg."""
    if not prismatic:
        return unit
    for revolute, linear in (("kg m^2", "kg"), ("N m", "N"), ("rad", "m")):
        unit = unit.replace(revolute, linear)
    return unit
