"""Torque that was not written in some rows: a straight line stands there, and an event says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import finite
from .events import Event, ordered
from .outliers import SPIKE
from .recording import Recording


def filled(samples: Recording, joints: tuple[str, ...]) -> Recording:
    """Samples with straight lines where a joint's torque is empty, and where that is."""
    tau = samples.signals["tau"]
    if not np.isnan(tau.sum()):
        return samples
    each = [
        finite.filled(own, f"the torque of joint {joint!r}", samples.where)
        for joint, own in zip(joints, tau.T)
    ]
    places = tuple((j, *run) for j, (_, found) in enumerate(each) for run in found)
    return replace(
        samples,
        signals=samples.signals | {"tau": np.stack([own for own, _ in each], axis=1)},
        empty=places,
    )


def told(samples: Recording, joints: tuple[str, ...]) -> tuple[Event, ...]:
    """Where a joint's torque was not written."""
    t, kinds = samples.t, ("unwritten", "empty")
    return ordered(
        [
            Event(kinds[b - a < SPIKE], samples.name, float(t[a]), float(t[b]), (joints[j],))
            for j, a, b in samples.empty
        ]
    )
