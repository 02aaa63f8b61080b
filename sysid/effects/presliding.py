"""Friction before sliding: Dahl's model."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_parameters import Linear, Shape


class Presliding(TorqueEffect):
    """Contacts bend like bristles before they slide, so that friction builds up over an angle after each reversal.

    Between two reversals z = d + (z_0 - d) exp(-travel/x0), d the direction: exact, whatever the speed.
    Nobody logged what the contacts did before: a joint that moves when a log begins has come as far as it has since it was last without
    speed, were its acceleration always that of the first sample. There it stood or turned, which nobody knows either: half bent back.
    """

    name = "presliding"
    equation = "tau = F z, z' = (qd - |qd| z) / x0"
    looks_like = "a loop against the angle after each reversal; has memory"
    tied_with = ("stribeck", "backlash", "coulomb")
    separate_by = "reversals of growing size, from a tenth of x0 to ten times it"
    maneuvers = ("reversals",)
    source = "Dahl 1968; Canudas 1995"
    memory = True

    F = Linear("N m", lower=0, says="friction once it slides; F/x0 is the stiffness at rest")
    x0 = Shape("rad", 0.0005, 0.1, of="angle", says="angle over which friction builds up")

    def columns(self, motion, joint, x0):
        return self.columns_at(motion, joint, [{"x0": x0}])[0]

    def columns_at(self, motion, joint, tried):
        moves = np.diff(motion.q[:, joint], prepend=motion.q[:1, joint])
        way = np.sign(moves)
        # a sample that stands still belongs to the stretch before it
        moving = np.flatnonzero(way)
        if not len(moving):
            return np.zeros((len(tried), 1, len(way)))
        way = way[moving[np.maximum(np.searchsorted(moving, np.arange(len(way)), side="right") - 1, 0)]]
        first = np.flatnonzero(np.diff(way, prepend=0.0))
        travelled = np.cumsum(np.abs(moves))
        begun = np.concatenate([[0.0], travelled[first[1:] - 1]])
        strokes, count = np.diff(begun, append=travelled[-1]), np.diff(first, append=len(way))
        since, ways, out = travelled - np.repeat(begun, count), way[first].tolist(), []
        speed, push, goes = motion.qd[0, joint], motion.qdd[0, joint], motion.direction(joint)[0]
        come = 0.5 * speed**2 / (goes * push) if goes * push > 0.0 else np.inf
        for x0 in (shapes["x0"] for shapes in tried):
            z, starts = goes * (1.0 - 1.5 * np.exp(-come / x0)), []
            for direction, kept in zip(ways, np.exp(-strokes / x0).tolist()):
                starts.append(z)
                z = direction + (z - direction) * kept
            start = np.repeat(starts, count)
            out.append((way + (start - way) * np.exp(-since / x0))[None])
        return np.stack(out)
