"""The ten numbers themselves: linear least squares, with nothing that keeps a body possible."""

import numpy as np

from .parameterization import Parameterization
from .pseudo import PARAMETERS


class Linear(Parameterization):
    """theta = pi. The baseline whose nonphysical answers the paper counts (VI-B)."""

    name = "linear"
    coordinates = PARAMETERS

    def parameters(self, theta):
        return np.array(theta, dtype=float)

    def inverse(self, pi):
        return np.array(pi, dtype=float)

    def jacobian(self, theta):
        return np.broadcast_to(np.eye(10), np.shape(theta)[:-1] + (10, 10))

    def hessian(self, theta, gradient):
        return np.zeros(np.shape(theta)[:-1] + (10, 10))
