"""Coulomb friction that differs between the two directions."""

from ..effect import TorqueEffect
from ..effect_parameters import Linear


class AsymmetricCoulomb(TorqueEffect):
    """Contact that slides more easily one way than the other; `coulomb` is the mean of both ways."""

    name = "asymmetric_coulomb"
    equation = "tau = dF/2 |sign(qd)|, dF = Fc+ - Fc-"
    looks_like = "a step of unequal height wherever the speed changes sign: a constant while the joint moves, nothing while it stands"
    tied_with = ("torque_bias",)
    separate_by = "torque at rest: a bias stays, friction goes"
    same_in_motion = ("torque_bias",)
    maneuvers = ("poses",)
    source = "Elhami & Brookfield 1996"
    elementwise = True

    dF = Linear("N m", says="how much more friction forwards than backwards")

    def columns(self, motion, joint):
        return 0.5 * motion.direction(joint)[None] ** 2
