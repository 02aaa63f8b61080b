"""How a sum of columns, each with a weight of its own at every instant, changes with the motion.

Of bodies exactly (`bodies`); of effects and suspects, and of which rows count, by differences. Where
effects see the bodies' load, or change what bodies see, all of it by differences.
"""

from __future__ import annotations

import numpy as np

from ..effect import TorqueEffect
from ..motion import Piece
from . import bodies
from .columns import piece, with_changes
from .information import Known


def slopes(known: Known, weights, q, qd, qdd) -> np.ndarray:
    """(3, dof, n) of the sum of a motion's columns over noise, as far as they count, in q, qd and qdd.

    Args:
        weights (dof, all, n). q, qd, qdd: (n, dof). What looks back in time has no slope here.
    """
    apart = all(
        isinstance(effect, TorqueEffect) and not effect.uses_load for effect, _ in known.model.terms
    )
    exact, count, bare = np.zeros((3, *q.T.shape)), 10 * known.model.bodies, np.zeros(q.T.shape)
    if apart:
        over = known.counted(qd, qdd)
        own = weights[:, :count] * over[:, None]
        bare, exact = bodies.summed(known.model.robot, own, q, qd, qdd)
        bare = np.divide(bare, over, out=np.zeros(bare.shape), where=over > 0.0)
    columns_of = _effects if apart else _all

    def told(q, qd, qdd):
        """(samples,) what is left of the sum, of samples again and again over the motion's instants."""
        copies = len(q) // len(weights.T)
        sums = [np.tile(own, copies) for own in bare]
        for joint, place, own in (
            *columns_of(known, piece(q, qd, qdd)),
            *_suspects(known, q, qd, qdd),
        ):
            own = own.reshape(len(own), copies, -1)
            sums[joint] += np.einsum("pcn,pn->cn", own, weights[joint, place]).ravel()
        return (np.array(sums) * known.counted(qd, qdd)).sum(axis=0)

    _, change = with_changes(told, q, qd, qdd)
    return exact + change.reshape(exact.shape)


def _all(known: Known, seen: Piece):
    """(joint, parameters (k,), columns (k, n)) of bodies and effects."""
    found = known.model.columns(seen, slice(0, len(seen.q)))
    return [(joint, known.model.support(joint), own) for joint, own in enumerate(found)]


def _effects(known: Known, seen: Piece):
    """The same of effects alone."""
    model, first = known.model, 10 * known.model.bodies
    for term, (effect, joints) in enumerate(model.terms):
        for joint in joints if effect.present(seen) else ():
            place = [
                first + k
                for k, c in enumerate(model.coefficients)
                if (c.term, c.joint) == (term, joint)
            ]
            yield joint, place, effect.columns(seen, joint, **model.shapes_of(term, joint))


def _suspects(known: Known, q, qd, qdd):
    """The same of suspects of the instant, by joint."""
    place, found = known.of_suspects(q, qd, qdd)
    return [(joint, place, own) for joint, own in enumerate(found)] if len(place) else []
