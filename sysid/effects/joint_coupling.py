"""A motor that turns with a second joint."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_options import one_of
from ..effect_parameters import Linear
from ..errors import ConfigError


class JointCoupling(TorqueEffect):
    """A joint's motor, or the bevel gear it drives, turns with a neighbouring joint too, as in many wrists: inertia and friction of one
    joint follow the motion of the other.
    """

    name = "joint_coupling"
    equation = "tau = Ia qdd_i + Fv qd_i + Fs sign(qd_i + qd_j) + Fd sign(qd_i - qd_j), i the other joint"
    looks_like = "residual of one joint that follows the motion of another"
    tied_with = ("products of inertia of the links between both joints", "coulomb")
    separate_by = "move one joint alone, then the other"
    source = "wrists of the Staubli kind; no reference"
    options = {"other": "the name of the other joint (default: the joint before it, for the first the one after)"}

    other = None
    joints: tuple[str, ...] = ()
    Ia = Linear("kg m^2", says="inertia that the other joint's acceleration moves")
    Fv = Linear("N m s/rad", says="viscous friction with the other joint's speed")
    Fs = Linear("N m", says="Coulomb friction with the sum of both speeds")
    Fd = Linear("N m", says="Coulomb friction with the difference of both speeds")

    def bound(self, robot, joint):
        if len(robot.joints) < 2:
            raise ConfigError("joint_coupling needs a second joint", where="model.effects", do="leave it out")
        bound = self.given()
        bound.joints = tuple(robot.joints)
        if self.other is not None:
            one_of(bound, "other", [name for k, name in enumerate(robot.joints) if k != joint])
        return bound

    def variants(self, robot, joint):
        return [{"other": name} for k, name in enumerate(robot.joints) if k != joint]

    def unit_on(self, unit, robot, joint):
        slides, turned = robot.prismatic[joint], not robot.prismatic[self._beside(joint)]
        effort, way = "N" if slides else "N m", "rad" if turned else "m"
        if unit == "kg m^2":
            return unit if turned and not slides else "kg m" if turned or not slides else "kg"
        return unit.replace("N m", effort).replace("rad", way)

    def _beside(self, joint):
        return self.joints.index(self.other) if self.other is not None else joint - 1 if joint else 1

    def slides_over(self, joint, dof):
        own, other = np.eye(dof)[[joint, self._beside(joint)]]
        return np.stack([other + own, other - own])

    def columns(self, motion, joint):
        i = self._beside(joint)
        qd, rest = motion.qd, motion.rest[i] + motion.rest[joint]
        signs = [np.where(np.abs(speed) > rest, np.sign(speed), 0.0) for speed in (qd[:, i] + qd[:, joint], qd[:, i] - qd[:, joint])]
        return np.stack([motion.qdd[:, i], qd[:, i], *signs])
