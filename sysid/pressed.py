"""Joints that are held where they hardly move by more than their friction: a stop, a contact, a brake."""

from __future__ import annotations

import numpy as np

from .estimate import Fit
from .plausible import ROWS, Reason

_SLOW = 0.05  # of a joint's usual speed: as good as standing
_MORE = 2.0  # times its Coulomb friction, which a rough bearing at rest may have
_HALF, _FEWEST = 0.5, 20  # of a joint's squared error; rows


def pressed(fit: Fit) -> dict[str, Reason]:
    """{joint: why} of joints that have most of their squared error, on the training logs or on the
    test logs, in rows in which they hardly move and miss a torque that is more than their friction.

    At rest friction may be anything up to that which it has in motion, and no more: what holds a
    joint beyond it is no law of the joint.
    """
    out: dict[str, Reason] = {}
    most_missing: dict[str, float] = {}
    for part, whole in fit.predictions.items():
        told = whole.thinned(ROWS)
        if told.states is None:
            continue
        rows, speeds = told.states.index, np.abs(told.states.qd)
        for j, joint in enumerate(fit.joints):
            friction = fit.parameters_of("coulomb", j)
            use = np.ones(len(rows), bool) if told.use is None else told.use[rows, j]
            if not friction or use.sum() < _FEWEST:
                continue
            holds = abs(next(iter(friction.values()))[0])
            left, speed = told.residual[rows, j][use], speeds[use, j]
            slow, square = speed < _SLOW * np.sqrt(np.mean(speed**2)), left**2
            there = slow & (np.abs(left) > _MORE * holds)
            if slow.all() or there.sum() < _FEWEST:
                continue
            most = square[there].sum() > _HALF * square.sum()
            # where noise is all that is left it is alike everywhere
            if not most or square[there].mean() < _MORE**2 * square[~slow].mean():
                continue
            at, unit = float(np.median(told.states.q[use, j][there])), told.units[j]
            size, name = np.sqrt(np.mean(square[there])), "training" if part == "train" else part
            if size <= most_missing.get(joint, 0.0):
                continue
            most_missing[joint] = size
            out[joint] = Reason(
                f"most of its error on the {name} logs is where it hardly moves, about {at:.3g} "
                f"{'rad' if unit == 'N m' else 'm'}: {size:.3g} {unit} is missing there, more than "
                f"its friction of {holds:.3g} {unit} holds, so something else does, as a stop, a "
                "contact or a brake; leave these times out (`mask` under `preprocess:`), or ask "
                "with `events: keep`, which finds a stop",
                settles=True,
            )
    return out
