"""What functions of the motion and what no noise does leave of a residual, of each stretch of a
log."""

from dataclasses import dataclass

import numpy as np

from ..frequencies import low
from ..lowpass import KEPT
from . import bursts, outliers, repeats
from .motion_functions import Kinematics, kinematics
from .pursuit import Functions
from .stretches import Run, bandwidth_of, bridged, runs_of, smoothed, whole


@dataclass(frozen=True)
class Shared:
    """What joints have in common whose rows that count are the same."""

    runs: list[Run]
    calm: list[Run]  # the same without what is faster than the motion
    motion: Kinematics | None
    bandwidth: float
    periods: list[float | None]  # of each stretch [samples]

    @property
    def repeating(self) -> tuple[list[int], list[int]]:
        """The numbers of the stretches that repeat, and of those that do not."""
        again = [k for k, period in enumerate(self.periods) if period is not None]
        return again, [k for k, period in enumerate(self.periods) if period is None]


def shared_by(q, step, use, memory: dict, angles) -> Shared:
    """What the joints share whose rows that count are `use`, made once."""
    key = b"".join(np.packbits(u).tobytes() for u in use)
    if key not in memory:
        runs = runs_of(q, step, use)
        looked = whole(runs, [run.counts for run in runs], [len(x) for x in q]) if runs else []
        periods = [repeats.period_of(x, counts) for x, counts in zip(q, looked)]
        bandwidth = bandwidth_of(runs) if runs else 0.0
        if angles is not None and 0.0 < angles.band < bandwidth:
            bandwidth = angles.band
        known = angles is not None and bandwidth > 0.0
        calm = [smoothed(run, bandwidth) for run in runs] if known else runs
        motion = kinematics(calm) if runs else None
        memory[key] = Shared(runs, calm, motion, bandwidth, periods)
    return memory[key]


def rest_of(shared: Shared, raw, torque, joint: int, drawn):
    """A residual (n,) of each run without what functions of the motion explain and without what no
    noise does; which rows (n,) are kept; how many functions there were and the power they took."""
    runs, steps = shared.runs, [run.step for run in shared.runs]
    predicted = [m - r for m, r in zip(torque, raw)]
    if shared.calm is not runs:
        highest = KEPT * shared.bandwidth
        predicted = [low(p, highest, step) for p, step in zip(predicted, steps)]
    asked = Functions(shared.calm, shared.motion, predicted, joint, shared.bandwidth)
    counts = [run.counts for run in runs]
    found = asked.removed_from(raw, counts)
    rest = found[0]
    usual = outliers.usual(rest, drawn, steps, shared.bandwidth)
    kept = bursts.calm(rest, counts, steps, usual)
    even = rest if usual is None else [v / u for v, u in zip(rest, usual)]
    kept = outliers.away_from_reversals(runs, shared.motion.v, even, kept)
    rest = [bridged(v, k) for v, k in zip(rest, kept)]
    digit = outliers.digit_of(np.concatenate([m[run.counts] for m, run in zip(torque, runs)]))
    ends = np.cumsum([len(v) for v in rest])[:-1]
    speeds = np.split(shared.motion.v[:, joint], ends)
    kept, _ = outliers.without(rest, kept, steps, shared.bandwidth, digit, drawn, speeds)
    # once more, without what no noise does
    if not all(np.array_equal(own, all_) for own, all_ in zip(kept, counts)):
        found = asked.removed_from(raw, kept)
    rest, number, removed = found
    return [bridged(v, k) for v, k in zip(rest, kept)], kept, number, removed
