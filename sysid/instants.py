"""Samples as effects see them that look at one instant alone: at no time, with nothing beside them."""

from __future__ import annotations

import numpy as np

from .motion import Piece


class Instants:
    """What an elementwise effect may look at of samples (n, dof), as n dof samples of one joint: a
    `Piece` takes longer to make than Pinocchio's inverse dynamics of an arm."""

    __slots__ = ("load", "q", "qd", "qdd", "t")

    def __init__(self, q, qd, qdd, load):
        self.q, self.qd, self.qdd = q.reshape(-1, 1), qd.reshape(-1, 1), qdd.reshape(-1, 1)
        self.load = None if load is None else load.reshape(-1, 1)
        self.t = self.q  # as long as the samples; no effect of this kind looks at the clock

    def direction(self, joint: int) -> np.ndarray:
        """As `Piece.direction`, at no rounding of the speed."""
        return np.sign(self.qd[:, joint])


def at_no_time(q, qd, qdd, load=None) -> Piece:
    """Samples (n, dof) as effects see them: at no time, with no signal beside them."""
    n, dof = q.shape
    zero, still = np.zeros(n), np.zeros(dof)
    return Piece(
        log=0, step=1.0, t=zero, q=q, qd=qd, qdd=qdd, tau=zero[:, None], measured=zero[:, None],
        signals={}, use=None, smoother=None, core=slice(0, n), rest=still, noise=still, load=load,
    )  # fmt: skip
