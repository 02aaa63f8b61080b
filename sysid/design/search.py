"""Many starts, in several processes: random motions, and searches from the best of them.

Each start has a random stream of its own, and searches go on in slices that all of them share out:
the same seed gives the same motion whatever the number of processes, and Ctrl-C keeps the best
motion of the slices that have ended.
"""

from __future__ import annotations

import os
import signal
import time
import warnings
from collections.abc import Callable

import numpy as np
from joblib import Parallel, cpu_count, delayed

from ..errors import SysidWarning
from ..threads import single_threaded
from . import solve
from .fourier import Fourier
from .problem import Problem, drawn
from .solve import Climb, Found

_ROUNDS = (1, 2, 4, 8)  # of the slowest harmonic
DRAWN = 4  # random motions for each number of rounds
IMPROVED = 4  # starts of a search: the best of them
_WORTH = 8.0  # s of work from which others help: a process takes two to begin
_SLICE = 12  # linear programs, less than a second or two


def searched(
    problem: Problem, pose, fastest: float, seed: int, *, processes: int | None = None,
    tell: Callable[[str, float], None] = lambda stage, share: None,
) -> tuple[Found | None, float]:  # fmt: skip
    """The best motion of all starts, None where no start keeps to the limits; and log det M of the
    best random one.

    Args:
        pose: (dof,) about which motions begin. fastest [Hz]: harmonics stay below. processes: as
            many as there are cores, where it is None.
    """
    work = _shared(1)
    asked = [
        (problem, pose, (seed, r, k)) for r in rounds(problem.family, fastest) for k in range(DRAWN)
    ]
    starts = [found for found in work(start, asked) if np.isfinite(found.value)]
    random_best = max((found.log_det for found in starts), default=-np.inf)
    starts = sorted(starts, key=lambda found: -found.value)[:IMPROVED]
    climbs = [Climb(found.rounds, found.z) for found in starts]
    try:
        if climbs:
            begun = time.perf_counter()
            climbs[:1] = work(solve.climbed, [(problem, climbs[0], _SLICE)])
            left = (time.perf_counter() - begun) * len(climbs) * sum(solve.STEPS) / _SLICE
            if left > _WORTH:
                work = _shared(min(cpu_count() if processes is None else processes, len(climbs)))
        while not all(climb.over for climb in climbs):
            climbs = work(solve.climbed, [(problem, climb, _SLICE) for climb in climbs])
            tell("design", float(np.mean([climb.share for climb in climbs])))
    except KeyboardInterrupt:
        said = "stopped before the search had ended: this is the best motion so far"
        warnings.warn(SysidWarning(said), stacklevel=2)
        work = _shared(1)
    if climbs:
        starts += work(solve.ended, [(problem, climb) for climb in climbs])
    return max(starts, key=lambda found: found.value, default=None), random_best


def rounds(family: Fourier, fastest: float) -> list[int]:
    """Numbers of rounds with which no harmonic is above a frequency [Hz]; one at least."""
    return [r for r in _ROUNDS if r * family.harmonics / family.duration <= fastest] or [1]


def start(problem: Problem, pose, seed: tuple[int, int, int]) -> Found:
    """A random motion of seed[1] rounds that keeps to the limits, as large as they let it."""
    posed = problem.with_rounds(seed[1])
    return Found.of(posed, drawn(posed, pose, np.random.default_rng(seed)))


def _shared(processes: int) -> Callable[[Callable, list[tuple]], list]:
    """work(function, arguments) -> results, in order."""
    if processes == 1:
        return lambda work, asked: [_alone(os.getpid(), work, *one) for one in asked]
    parallel = Parallel(n_jobs=processes, max_nbytes=None)
    return lambda work, asked: parallel(delayed(_alone)(os.getpid(), work, *one) for one in asked)


def _alone(owner: int, work: Callable, *arguments):
    """A piece of work in a process that leaves Ctrl-C to its owner."""
    if os.getpid() != owner:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    return single_threaded(work)(*arguments)
