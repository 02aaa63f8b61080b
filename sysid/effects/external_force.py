"""Contact with the surroundings."""

import numpy as np

from ..effect import LinkEffect
from ..effect_parameters import Linear, called
from ..errors import ConfigError
from ..regressor import columns as regressor_columns


class ExternalForce(LinkEffect):
    """A link presses with a constant force on what it touches, during stated stretches of the logs' clocks.

    The force acts at the origin of the link's frame; what acts on the link is its opposite.
    """

    name = "external_force"
    equation = "tau = J' f while touching, f in the base frame"
    looks_like = "bursts on several joints at once"
    tied_with = ("payload", "torque_bias")
    separate_by = "the bursts of all joints agree with one J' f; repeat without contact"
    source = "virtual work; no reference"
    options = {"during": "a list of [start, stop] in seconds of the log's clock", "link": "the link that touches (default: the last)"}

    instantaneous = False  # the clock's
    during = ()

    def given(self, **options):
        chosen = super().given(**options)
        good = isinstance(chosen.during, (list, tuple)) and all(_stretch(item) for item in chosen.during)
        if not good:
            raise ConfigError(f"external_force.during is {chosen.during!r}", where="model.effects", allowed="a list of [start, stop], start < stop, in s")
        return chosen

    def coefficients(self):
        return tuple(
            called(Linear("N", says=f"force along {axis} from {start:g} to {stop:g} s"), f"f{k}{axis}")
            for k, (start, stop) in enumerate(self.during, 1)
            for axis in "xyz"
        )

    def columns(self, motion, robot):
        still, behind = np.zeros(motion.q.shape), None if motion.deflection is None else motion.deflection * [[[1.0]], [[0.0]], [[0.0]]]
        # a unit mass at rest under gravity -e needs the force e at the origin of its frame: its column is J' e
        mass = 10 * self.body(robot)
        unit = [regressor_columns(robot, motion.q, still, still, gravity=-e, deflection=behind)[:, mass] for e in np.eye(3)]
        parts = [_window(motion.t, start, stop) * column for start, stop in self.during for column in unit]
        return np.stack(parts, axis=1) if parts else np.zeros((robot.dof, 0, len(motion.t)))


def _stretch(item) -> bool:
    return isinstance(item, (list, tuple)) and len(item) == 2 and all(type(x) in (int, float) for x in item) and item[0] < item[1]


def _window(t, start, stop):
    """1 from start to stop with cosine edges of 0.05 s, at most a quarter of it, inside."""
    edge = min(0.05, 0.25 * (stop - start))
    return 0.5 - 0.5 * np.cos(np.pi * np.clip(np.minimum(t - start, stop - t) / edge, 0.0, 1.0))
