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
MANEUVERS = 0.4  # of the time: what maneuvers have where they are tried
IMPROVED = 4  # starts of a search: the best of them
_CLEAR = 1.0  # of its worth: less is what one start is above another
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
    asked = _starts(problem, pose, fastest, seed)
    starts = [found for found in work(start, asked) if np.isfinite(found.value)]
    random_best = max((f.log_det for f in starts if not f.family.maneuvers), default=-np.inf)
    if kinds := problem.known.maneuvers:
        family = problem.family.followed_by(kinds, problem.known.joints, MANEUVERS, fastest)
        asked = _starts(problem.of(family), pose, fastest, seed)
        starts += [found for found in work(start, asked) if np.isfinite(found.value)]
    starts = _improved(starts)
    climbs = [Climb(found.family, found.z) for found in starts]
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
    plain = [found for found in starts if not found.family.maneuvers]
    best = max(starts, key=lambda found: found.value, default=None)
    simple = max(plain, key=lambda found: found.value, default=best)
    # what maneuvers add must be more than where searches happen to end
    return (best if best is None or best.value > simple.value + _CLEAR else simple), random_best


def _improved(starts: list[Found]) -> list[Found]:
    """The best of the random motions; one of them has maneuvers where any has: these tell little until
    they have found their sizes."""
    ordered = sorted(starts, key=lambda found: -found.value)
    best, more = ordered[:IMPROVED], [one for one in ordered if one.family.maneuvers]
    if more and not any(one.family.maneuvers for one in best):
        best[-1:] = more[:1]
    return best


def _starts(problem: Problem, pose, fastest: float, seed: int) -> list[tuple]:
    """What `start` is asked for: of as many rounds one problem, that its bases are made once."""
    own = [problem.with_rounds(r) for r in rounds(problem.family, fastest)]
    return [(one, pose, (seed, one.family.rounds, k)) for one in own for k in range(DRAWN)]


def rounds(family: Fourier, fastest: float) -> list[int]:
    """Numbers of rounds with which no harmonic is above a frequency [Hz]; one at least."""
    return [r for r in _ROUNDS if r * family.harmonics / family.time <= fastest] or [1]


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
