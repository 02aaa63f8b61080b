"""Torque that was not logged: in some rows, where a straight line stands and an event says so, or in all of a log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from . import finite
from .events import Event, ordered
from .outliers import SPIKE
from .recording import Recording
from .repeats import TRAVELS
from .segment import Segment


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


def extent(segment: Segment) -> np.ndarray:
    """(4, dof): the least and the greatest torque and angle of each joint."""
    tau, q = segment.tau, segment.q
    return np.stack([tau.min(axis=0), tau.max(axis=0), q.min(axis=0), q.max(axis=0)])


def unlogged(
    logs: Sequence[tuple[str, float, float, np.ndarray]], joints: Sequence[str]
) -> list[list[Event]]:
    """Of each log the joints whose torque never changes in it: though they move there, or where it
    is the same in another log in which they do.

    Args:
        logs: name, first and last time [s], and the `extent` (segments, 4, dof) of its segments.
    """
    found = []
    for *_, extents in logs:
        low, high = extents[:, 0].min(axis=0), extents[:, 1].max(axis=0)
        travel = extents[:, 3].max(axis=0) - extents[:, 2].min(axis=0)
        found.append((np.where(low == high, low, np.nan), travel > TRAVELS))
    known = [{own[j] for own, moves in found if moves[j]} for j in range(len(joints))]
    return [
        [
            Event("missing", name, start, stop, (joint,))
            for j, joint in enumerate(joints)
            if own[j] in known[j]  # NaN is in none
        ]
        for (name, start, stop, _), (own, _) in zip(logs, found)
    ]
