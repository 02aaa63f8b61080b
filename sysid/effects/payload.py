"""A load that some logs carry."""

import numpy as np

from ..effect import Linear, WrenchEffect, called, last_link, one_of, texts
from ..inertia import PARAMETERS, UNITS
from ..regressor import body_motions, wrench_columns


class Payload(WrenchEffect):
    """A rigid body held by a link during some logs; its ten parameters stand about that link's frame.

    Present in every log, it is the link's own inertia and cannot be told from it.
    """

    name = "payload"
    equation = "tau = J' (f, n) of a body with m, h, I on the link"
    looks_like = "residual like the last link's, in some logs alone"
    tied_with = ("the link that holds it, exactly in a single log", "torque_gain")
    separate_by = "the same motion with the payload and without"
    source = "Swevers, Verdonck, Naumer, Pieters & Biber 2002"
    options = {
        "link": "the link that holds it (default: the last)",
        "logs": "the logs that have it, by their names under `data` (default: all)",
    }

    link = None
    logs = None

    def given(self, **options):
        chosen = super().given(**options)
        texts(chosen, "logs")
        return chosen

    def bound(self, robot, joint):
        bound = self.given()
        bound.link = self.link if self.link is not None else last_link(robot)
        one_of(bound, "link", [body.name for body in robot.bodies if body.kind == "link"])
        return bound

    def coefficients(self):
        return tuple(called(Linear(unit, lower=0 if p == "m" else None, says=f"{p} of the payload"), p) for p, unit in zip(PARAMETERS, UNITS))

    def columns(self, motion, robot):
        out = np.zeros((robot.dof, 10, len(motion.t)))
        if self.logs is not None and motion.source not in self.logs:
            return out
        (row,) = [b for b, body in enumerate(robot.bodies) if body.kind == "link" and body.name == (self.link or last_link(robot))]
        held = body_motions(robot, motion.q, motion.qd, motion.qdd, gravity=motion.gravity, deflection=motion.deflection)[row]
        for joint, (linear, angular) in held.jacobian.items():
            wrench_columns(held, linear, angular, out[joint])
        return out
