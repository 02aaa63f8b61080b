"""What the blind benchmark hides: effects of the catalogue, laws outside it, and their sizes."""

from __future__ import annotations

from collections.abc import Callable

from .fourth_laws import FOURTH
from .new_laws import NEW
from .old_laws import OLD
from .third_laws import THIRD

BASELINE = ("viscous", "coulomb", "armature")  # in every model from the start
ABSORBED = (
    "payload",
    "external_force",
)  # no model predicts them on another log: the last link's own inertia, and when somebody pushes
ROBOT_WIDE = ("gravity_tilt", "payload", "external_force")
EFFECTS = (
    "asymmetric_coulomb", "asymmetric_viscous", "stribeck", "quadratic_drag", "sublinear_viscous", "presliding", "load_friction",
    "directional_efficiency", "position_friction", "warmup", "joint_coupling", "elasticity", "backlash", "cogging", "torque_bias", "torque_gain",
    "torque_saturation", "current_lag", "delay", "encoder_offset", "encoder_eccentricity", "gravity_tilt", "spring", "cable",
)  # fmt: skip
SIZES = (0.3, 3.0)  # times the simulator's default strength
LARGEST = {
    "asymmetric_coulomb": 2.0,
    "asymmetric_viscous": 2.0,
    "torque_saturation": 1.9,
}  # beyond it friction turns negative, or little torque is read
#: what the catalogue does not have: (equation, maker of the torque of joint j)
OUTSIDE: dict[str, tuple[str, Callable]] = {**OLD, **NEW, **THIRD, **FOURTH}
