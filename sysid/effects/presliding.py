"""Friction before sliding: Dahl's model."""

import numpy as np

from ..effect import TorqueEffect
from ..effect_parameters import Linear, Shape
from ..motion import NOISE_TRAVEL

_BEGINNING = 0.05  # s of a log that say whether a joint moves when it begins


class Presliding(TorqueEffect):
    """Contacts bend like bristles before they slide, so that friction builds up over an angle after each reversal.

    Between two reversals z = d + (z_0 - d) exp(-travel/x0), d the direction: exact, whatever the speed.
    Nobody logged what the contacts did before. A joint that moves when a log begins has come, since it last had no speed, as far as its first
    speed and acceleration say. There its contacts are taken to be bent half way against the motion, between not at all (it stood) and
    wholly (it turned round).
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
        goes, come = _come(motion, joint)
        for x0 in (shapes["x0"] for shapes in tried):
            z, starts = goes * (1.0 - 1.5 * np.exp(-come / x0)), []
            for direction, kept in zip(ways, np.exp(-strokes / x0).tolist()):
                starts.append(z)
                z = direction + (z - direction) * kept
            start = np.repeat(starts, count)
            out.append((way + (start - way) * np.exp(-since / x0))[None])
        return np.stack(out)


def _come(motion, joint: int) -> tuple[float, float]:
    """Which way a joint moves when a log begins, zero where it stands, and how far it has come since it last had no speed."""
    first = motion.q[: 1 + round(_BEGINNING / motion.step), joint]
    if not abs(first[-1] - first[0]) > NOISE_TRAVEL * motion.noise[joint]:
        return 0.0, np.inf
    speed, goes = motion.qd[0, joint], motion.direction(joint)[0]
    push = goes * motion.qdd[0, joint]
    # beyond any x0 where it slows down, or hardly gains speed
    return goes, 0.5 * speed**2 / push if push > 1e-9 * speed**2 else np.inf
