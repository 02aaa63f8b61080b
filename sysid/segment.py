"""A stretch of a log: uniformly sampled signals without a gap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .clock import Left

# A step longer than this many median steps is a hole that interpolation would invent motion for.
GAP_STEPS = 10.0


def gaps(t) -> np.ndarray:
    """Rows before which a clock (n,) has a gap: of samples that come in packets most steps are next to nothing, and the mean is usual."""
    steps = np.diff(t)
    return np.flatnonzero(steps > GAP_STEPS * max(np.median(steps), np.mean(steps))) + 1 if len(steps) else np.zeros(0, dtype=int)


@dataclass(frozen=True)
class Segment:
    """Uniformly sampled signals without a gap. t (n,) [s]; q, tau (n, dof); qd, qdd (n, dof) or None where not logged.
    clock: what is left of the errors of stamps that were corrected. core: the rows that are its own where it is a
    span of a longer stretch and the others are its neighbours', which filters look at; None where all are."""

    t: np.ndarray
    step: float
    q: np.ndarray
    tau: np.ndarray
    qd: np.ndarray | None
    qdd: np.ndarray | None
    signals: dict[str, np.ndarray]
    clock: Left | None = None
    core: slice | None = None

    @property
    def spread(self) -> float:
        """How far to either side [s] the correction of its stamps may have spread what all joints did at once; zero where they were right."""
        return 0.0 if self.clock is None else self.clock.spread
