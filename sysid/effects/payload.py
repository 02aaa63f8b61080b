"""A load that some logs carry, or parts of them."""

import numpy as np

from ..effect import LinkEffect, last_link
from ..effect_options import stretches, subsets, texts
from ..effect_parameters import Linear, called
from ..inertia import PARAMETERS, UNITS
from ..regressor import body_motions, wrench_columns


class Payload(LinkEffect):
    """A rigid body held by a link during some logs, or between two times of a log's own clock, as possible as the links are; its ten
    parameters stand about that link's frame.

    Present in every log, it is the link's own inertia and cannot be told from it.
    """

    name = "payload"
    equation = "tau = J' (f, n) of a body with m, h, I on the link"
    looks_like = "residual like the last link's, or another hand's, in some logs alone, or for a part of a log"
    tied_with = ("the link that holds it, exactly in a single log", "torque_gain")
    separate_by = "the same motion with the payload and without"
    source = "Swevers, Verdonck, Naumer, Pieters & Biber 2002"
    mimics_mass = True
    options = {
        "link": "the link that holds it (default: the last)",
        "logs": "the logs that have it, by their names under `data` (default: all)",
        "stretches": "the stretches that have it, from and to in seconds of each log's clock (default: whole logs; each a text 'LOG START STOP')",
    }

    simulators = {"inertia": "*"}
    logs = None
    stretches = None

    def given(self, **options):
        chosen = super().given(**options)
        texts(chosen, "logs")
        stretches(chosen, "stretches")
        return chosen

    def places(self, robot):
        """The last link, others that carry no link, other hands and feet, and what carries two such: the palm of fingers of one link."""
        links = [body for body in robot.bodies if body.kind == "link"]
        parents = [robot.parents[body.row] for body in links]
        ends = [parent for body, parent in zip(links, parents) if body.row not in parents]
        asked = [body for body in links if body.row not in parents or ends.count(body.row) > 1]
        return [{}, *({"link": body.name} for body in asked if body.row != robot.bodies[last_link(robot)].row)]

    def among(self, logs):
        return subsets(logs)

    @property
    def instantaneous(self):
        return self.logs is None and self.stretches is None

    def coefficients(self):
        return tuple(called(Linear(unit, says=f"{p} of the payload", of_body=True), p) for p, unit in zip(PARAMETERS, UNITS))

    def columns(self, motion, robot):
        out = np.zeros((robot.dof, 10, len(motion.t)))
        if self.logs is not None and motion.source not in self.logs:
            return out
        there = None if self.stretches is None else self.held(motion.source, motion.t)
        if there is not None and not there.any():
            return out
        held = body_motions(robot, motion.q, motion.qd, motion.qdd, gravity=motion.gravity, deflection=motion.deflection)[self.body(robot)]
        for joint, (linear, angular) in held.jacobian.items():
            wrench_columns(held, linear, angular, out[joint])
        return out if there is None else out * there

    def held(self, log: str, t) -> np.ndarray:
        """Whether times t (n,) of a log's clock lie in a stretch which it is there: (n,) bool."""
        there = np.zeros(len(t), dtype=bool)
        for name, start, stop in stretches(self, "stretches"):
            there |= (name == log) & (t >= start) & (t < stop)
        return there
