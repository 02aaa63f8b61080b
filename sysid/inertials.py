"""What a robot's file says of its bodies that cannot be meant, by itself and before any log: then no torque is held against it."""

from __future__ import annotations

import numpy as np

from . import regressor
from .inertia import pseudo
from .link_priors import placeholders
from .robot import Robot

_POSES = 64  # held still
_OVER = 3.0  # times the torque that the file allows its drives: of forty robots of example-robot-data none needs more than 0.61 of it
_ALIKE = 1e-6  # of a number, and m: less is the same, and nothing


def unmeant(robot: Robot) -> str:
    """Why the masses of a robot's file say nothing of the torques' units, in words; "" where they may be meant."""
    if placeholders([link.inertial[0] for link in _stated(robot)]):
        return "no link of the robot's file weighs a gram: placeholders, whose masses say nothing of torques"
    if _one_for_all(robot):
        return "the robot's file states one and the same inertia for every link: a placeholder, whose masses say nothing of torques"
    times = overweight(robot)
    if times > _OVER:
        return (
            f"the bodies of the robot's file need {times:.2g} times the torque that it allows its drives, to be held still: its masses are in "
            "another unit, as g, or far too large, and say nothing of torques"
        )
    return ""


def overweight(robot: Robot) -> float:
    """How many times the torque that a robot's file allows its drives its bodies need to be held still, where they need most of it: in the
    median over the joints; 0 where it states no such torque, or the same for all joints."""
    most = np.array([robot.source.joints[joint].effort for joint in robot.joints])
    stated = np.isfinite(most) & (most > 0.0)
    if len(set(most[stated].tolist())) < 2:
        return 0.0
    low, high = np.where(np.isfinite(robot.limits), robot.limits, [-np.pi, np.pi]).T
    wide = (high - low > 0.0) & (high - low < 2.0 * np.pi)
    low, high = np.where(wide, low, -np.pi), np.where(wide, high, np.pi)
    q = np.random.default_rng(0).uniform(low, high, (_POSES, robot.dof))
    need = np.abs(regressor.torque(robot, robot.prior, q, 0.0 * q, 0.0 * q)).max(axis=0)
    held = stated & (need > 0.01 * need.max())  # a joint about the vertical needs none
    return float(np.median(need[held] / most[held])) if held.any() else 0.0


def _stated(robot: Robot) -> list:
    """The links of a robot's file whose inertia it states, of those that its joints move."""
    links = (robot.source.links.get(body.name) for body in robot.bodies if body.kind == "link")
    return [link for link in links if link is not None and link.inertial is not None and link.inertial[0] > 0.0]


def _one_for_all(robot: Robot) -> bool:
    """Whether all links have one and the same inertia about their joint's own frame, and their file states it: links that are alike
    hang on their joints."""
    links = [pi for body, pi in zip(robot.bodies, robot.prior) if body.kind == "link"]
    if len(links) < 2 or len(_stated(robot)) < len(links):
        return False
    masses, centres, central = zip(*(pseudo.to_central(pi) for pi in links))
    if np.abs(centres).max() > _ALIKE:
        return False
    numbers = np.column_stack([masses, [np.linalg.eigvalsh(own) for own in central]])
    return bool(np.all(np.ptp(numbers, axis=0) <= _ALIKE * np.abs(numbers).max(axis=0)))
